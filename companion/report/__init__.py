"""The report of flights: one HTML page, usable without a network, for one flight or several."""

PAGE = "report.html"
"""Name of the page in a flight's folder."""
