"""Position error on trajectories: every planner, over speed, with and without lead, in wind."""
