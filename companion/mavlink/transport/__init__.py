"""Transports to the vehicle: UDP, TCP and serial ports, opened from the text of an endpoint."""
