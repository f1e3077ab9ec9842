"""MAVLink: bytes, messages, transports, signing. It knows no autopilot and no policy."""
