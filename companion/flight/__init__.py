"""One flight: its phases, the safety watch that runs beside them, and how it ends."""
