"""Recorded flights to look at: a page without other files, for one flight or several; a picture."""

PAGE = "report.html"
"""Name of the page in a flight's folder."""


class PictureError(Exception):
    """The picture cannot be drawn; the message says why and what to do."""
