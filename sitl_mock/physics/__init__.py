"""The physics: rigid body, rotors, rate loop, wind, ground, battery, sensors. No I/O, no clock."""
