"""MAVLink: bytes, messages, transports, signing. Knows no vehicle and no policy."""
