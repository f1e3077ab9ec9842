"""The study `nmpc`: predictive control with several models, their solve time and position error."""
