"""One flight: its phases, the control loop, the watch over both, and how it ends."""
