"""Clients' setpoints: their meaning, and the reference that follows from them."""
