"""MAVLink: bytes, messages, transports, signing. Nothing here depends on the autopilot."""
