"""What every autopilot has: state, commands, parameters, telemetry, setpoints, faults."""
