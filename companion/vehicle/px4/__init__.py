"""Everything specific to PX4."""
