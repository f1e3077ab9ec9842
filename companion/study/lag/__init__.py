"""Every planner behind a slow rate loop, beyond what the paper flies."""
