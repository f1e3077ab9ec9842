"""The report of flights: one HTML page that needs no network, for one flight or several."""

PAGE = "report.html"
"""Name of the page in a flight's folder."""
