"""Other programs (clients) on our link: a MAVLink router, and control by their setpoints.

"We" is this program. "Our component" is the MAVLink component that it is, and "our mode" the mode
in which the autopilot obeys its setpoints.
"""
