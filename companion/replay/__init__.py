"""Replays a flight: runs its control loop and guidance loop again with the recorded inputs."""
