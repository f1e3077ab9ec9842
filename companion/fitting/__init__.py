"""The one search for the nearest model: for what measures a flight, and what identifies a vehicle.

Needs only NumPy, and knows neither vehicles nor flights.
"""

from companion.fitting.least_squares import Projection, Solution, minimise, project

__all__ = ["Projection", "Solution", "minimise", "project"]
