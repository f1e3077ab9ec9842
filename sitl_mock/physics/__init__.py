"""The physics: rigid body, rotors, rate loop, wind, ground, battery, sensors (pure)."""
