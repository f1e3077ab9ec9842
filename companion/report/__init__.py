"""The report of flights: one HTML page that needs no network, for one flight or several."""
