"""Property tests try the same cases on every machine, however slow it is just now."""

import gc
from pathlib import Path

import pytest
from hypothesis import settings

from companion.config import known_drag

settings.register_profile("same", derandomize=True, deadline=None)
settings.load_profile("same")

# Collecting the tests makes objects that stay: looking for garbage among them takes a second.
gc.disable()


@pytest.fixture(autouse=True, scope="session")
def state_directory(tmp_path_factory):
    """Time stamps of signatures are never kept in the home of whoever runs the tests."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_STATE_HOME", str(tmp_path_factory.mktemp("state")))
        yield


@pytest.fixture(autouse=True, scope="session")
def no_earlier_flights():
    """What flights learned that somebody flew here, as by `make demo`, counts in no test."""
    flights = Path(__file__).parents[1] / "flights"
    newest = known_drag.newest
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            known_drag,
            "newest",
            lambda folder: newest(folder) if folder.absolute() != flights else None,
        )
        yield


def pytest_collection_finish():
    """What was imported by now stays: to walk through it again and again costs flights a tenth.

    Of the rest little is garbage, and it is looked for more rarely.
    """
    gc.collect()
    gc.freeze()
    gc.set_threshold(200_000, 20, 50)
    gc.enable()
