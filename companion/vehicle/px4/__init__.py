"""All that this program knows of PX4."""
