"""Clients' setpoints: what is commanded, and the reference that follows from it."""
