"""`flight.mcap`: the channels of a recorded flight, how they are written and how they are read."""
