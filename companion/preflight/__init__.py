"""What would go wrong with this vehicle and this configuration, found before take-off.

`gathering` listens and asks, `examination` judges what it brought, `repair` sets parameters.
Nothing in here arms or sends a setpoint.
"""
