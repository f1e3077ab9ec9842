"""An autopilot as we see it: its link, its state, its clock, and its kind."""
