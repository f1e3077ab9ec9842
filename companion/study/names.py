"""The studies by name, for whoever must know them without the extra that they need."""

OWN_STUDIES = ("lag",)
PAPER_STUDIES = ("fig2", "fig3", "fig4", "fig5", "rates", "kmax")
TIMED_STUDIES = ("nmpc",)
"""Not among `all`, whose files are the same on every machine: these time this one."""
TRACK = "track"
"""Not among `all` either: it flies the bundled vehicle for some minutes."""
STUDY_NAMES = (*PAPER_STUDIES, *OWN_STUDIES, *TIMED_STUDIES, TRACK, "all", "custom")
