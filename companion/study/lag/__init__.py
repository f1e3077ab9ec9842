"""Every planner with a slow rate loop, which the paper does not study."""
