"""MAVLink transport: sockets, framing, signing, link faults."""
