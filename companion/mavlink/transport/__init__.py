"""Ways to the vehicle: UDP, TCP and serial ports, opened from an endpoint's notation."""
