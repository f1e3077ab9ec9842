"""ArduCopter, simulated as recorded and measured: its numbers, texts and rules."""
