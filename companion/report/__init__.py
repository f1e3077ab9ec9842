"""Shows recorded flights: one HTML page about one flight or several, or a picture of a flight."""

PAGE = "report.html"
"""Name of the page in a flight's folder."""


class PictureError(Exception):
    """The picture cannot be drawn; the message says why and what to do."""
