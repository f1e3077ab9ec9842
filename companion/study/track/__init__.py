"""The study `track`: position error on trajectories, by planner, speed, lead and wind."""
