"""Recording of a flight, and the measurements computed from it afterwards."""
