"""The simulated ArduCopter: its numbers, texts and rules were recorded or measured on ArduPilot."""
