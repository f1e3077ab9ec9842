"""One flight: its phases, the watch beside them, and its exits."""
