"""The MAVLink router: the clients' channels and addresses, and the frames between them."""
