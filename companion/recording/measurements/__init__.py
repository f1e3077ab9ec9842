"""Measurements of a flight: tracking, steps, dead time, and the verdict.

summary           all figures of a flight: `Summary`, `--json`
recorded_summary  the same from a record, also of a flight that was killed
maneuver_figures, swing  errors of each maneuver; whether the vehicle swings
response, second_order   the response to steps, beside linear models
dead_time, flight_facts  measured dead time; phases, end and circumstances
verdict           each figure beside its limit
"""
