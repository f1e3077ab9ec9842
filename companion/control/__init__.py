"""The control loop answers each attitude sample; the guidance loop sets its targets."""
