"""Preflight checks: what would go wrong with this vehicle and this configuration.

`session` gathers the evidence, `all_checks` judges it, `parameter_fixes` sets parameters. Nothing
here arms the vehicle or sends a setpoint.
"""
