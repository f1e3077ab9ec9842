"""MAVLink on its way: sockets, framing, signing, a bad link."""
