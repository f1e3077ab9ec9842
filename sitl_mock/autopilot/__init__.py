"""What PX4 and ArduPilot share: state, commands, parameters, telemetry, setpoints, faults."""
