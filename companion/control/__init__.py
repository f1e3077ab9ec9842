"""The control loop that answers each sample, and the guidance loop that leaves it its targets."""
