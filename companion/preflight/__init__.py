"""Preflight checks: what would go wrong with this vehicle and this configuration.

`session` listens and asks, `all_checks` judges the evidence, `parameter_fixes` sets parameters.
Nothing here arms the vehicle or sends a setpoint.
"""
