"""What is written down of a flight, and what is computed from it afterwards."""
