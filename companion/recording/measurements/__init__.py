"""Measurements of a flight: tracking, steps, dead time, and whether they are within their limits.

summary           all figures of a flight: `Summary`, `--json`
recorded_summary  the figures of a recorded flight, also of one that was killed
maneuver_figures, swing  errors of each maneuver; whether the vehicle swings
response, second_order   the response to steps, compared with linear models
dead_time, flight_facts  measured dead time; phases, end and circumstances
verdict           compares each figure with its limit
"""
