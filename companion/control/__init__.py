"""The control loop sends a setpoint for each attitude sample; the guidance loop makes targets."""
