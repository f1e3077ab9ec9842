"""The study `lag`: every planner with a slow rate loop, which the paper does not study."""
