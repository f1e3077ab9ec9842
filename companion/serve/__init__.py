"""Other programs on our link: a MAVLink router, and control by their setpoints."""
