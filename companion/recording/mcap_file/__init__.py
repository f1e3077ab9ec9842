"""`flight.mcap`: the channels of a recorded flight, their writer and their reader."""
