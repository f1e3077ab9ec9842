"""Predictive control: solve time of each prediction model, and its position error in flight."""
