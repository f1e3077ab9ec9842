"""The vehicle itself: rigid body, rotors, rate loop, air, ground, battery, sensors (pure)."""
