"""The studies by name, for whoever must know them without the extra that they need."""

OWN_STUDIES = ("lag",)
PAPER_STUDIES = ("fig2", "fig3", "fig4", "fig5", "rates", "kmax")
STUDY_NAMES = (*PAPER_STUDIES, *OWN_STUDIES, "all", "custom")
