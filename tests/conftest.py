"""Property tests try the same cases on every machine, however slow it is just now."""

from hypothesis import settings

settings.register_profile("same", derandomize=True, deadline=None)
settings.load_profile("same")
