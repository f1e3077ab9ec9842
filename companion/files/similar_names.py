"""The known name that a mistyped one was probably meant to be."""

import difflib
from collections.abc import Iterable
from typing import Any

MIN_SIMILARITY = 0.5
"""Smallest `similarity` to an unknown key at which a key of the same section is suggested."""
MIN_SIMILARITY_ELSEWHERE = 0.75
"""Smallest `similarity` at which a key of another section is suggested."""


def name_hint(written: Any, known: Iterable[str]) -> str:
    """End of the message that refuses a name: "; did you mean …?"; empty if none is similar."""
    near = (
        most_similar_name(written, known, MIN_SIMILARITY_ELSEWHERE)
        if isinstance(written, str)
        else None
    )
    return f"; did you mean {near}?" if near else ""


def most_similar_name(name: str, known: Iterable[str], min_similarity: float) -> str | None:
    """The most similar known name, or None if none is as similar as `min_similarity`, 0..1."""
    similar = {each: similarity(name, each) for each in known}
    best = max(similar, key=similar.__getitem__, default=None)
    return best if best is not None and similar[best] >= min_similarity else None


def similarity(written: str, known: str) -> float:
    """Similarity from 0 to 1; nearly 1 if the known key begins or ends with the written one."""
    written = written.lower()
    if known.startswith(f"{written}_"):
        return 0.99
    if known.endswith(f"_{written}"):
        return 0.98
    return difflib.SequenceMatcher(None, written, known).ratio()
