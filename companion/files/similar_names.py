"""The known name that a mistyped one was probably meant to be."""

import difflib
from collections.abc import Iterable
from typing import Any

MIN_SIMILARITY = 0.5
"""Smallest `similarity` to an unknown key at which a key of the same section is suggested."""
MIN_SIMILARITY_IN_OTHER_SECTION = 0.75
"""Smallest `similarity` at which a key of another section is suggested."""


def name_hint(written_name: Any, known_names: Iterable[str]) -> str:
    """End of the message that refuses a name: "; did you mean …?"; empty if none is similar."""
    similar_name = (
        most_similar_name(written_name, known_names, MIN_SIMILARITY_IN_OTHER_SECTION)
        if isinstance(written_name, str)
        else None
    )
    return f"; did you mean {similar_name}?" if similar_name else ""


def most_similar_name(name: str, known_names: Iterable[str], min_similarity: float) -> str | None:
    """The most similar known name, or None if none is as similar as `min_similarity`, 0..1."""
    similarities = {each: similarity(name, each) for each in known_names}
    best_name = max(similarities, key=similarities.__getitem__, default=None)
    return (
        best_name if best_name is not None and similarities[best_name] >= min_similarity else None
    )


def similarity(written_name: str, known_name: str) -> float:
    """Similarity from 0 to 1; nearly 1 if the known key begins or ends with the written one."""
    written_name = written_name.lower()
    if known_name.startswith(f"{written_name}_"):
        return 0.99
    if known_name.endswith(f"_{written_name}"):
        return 0.98
    return difflib.SequenceMatcher(None, written_name, known_name).ratio()
