"""The MAVLink router: the clients' channels, their addresses, and what passes between them."""
