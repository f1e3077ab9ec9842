"""Everything specific to ArduCopter."""
