"""Position error on trajectories: every planner, several speeds, with and without lead, in wind."""
