"""The simulated PX4: its numbers, texts and rules were recorded or measured on PX4."""
