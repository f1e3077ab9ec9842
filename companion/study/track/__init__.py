"""The study `track`: position error by planner, speed and wind, with and without lead.

Lead (`guidance.lead`) compensates the response of the attitude loop.
"""
