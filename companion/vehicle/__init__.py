"""One vehicle, seen over MAVLink: its link, state, clock, and kind of autopilot."""
