"""Other programs (clients) on our link: a MAVLink router, and control by their setpoints.

"We" is this program. "Our component" is this program as a MAVLink component, and "our mode" is the
mode in which the autopilot obeys this program's setpoints.
"""
