"""Configuration errors in one sentence: where, what, and the nearest key that exists."""

import difflib
import typing
from collections.abc import Iterable
from typing import Any

from pydantic import BaseModel, ValidationError

_LISTED = 20
"""Lists of known words longer than this are not shown."""


class ConfigError(Exception):
    """The configuration cannot be used; the message is one sentence for the user."""


def suggestion(word: str, known: Iterable[str]) -> str:
    """Return ``; did you mean ...?`` with the nearest known word, or nothing."""
    names = list(known)
    near = difflib.get_close_matches(word, names, n=1, cutoff=0.5)
    if near:
        return f"; did you mean {near[0]}?"
    return f"; known are {', '.join(sorted(names))}" if len(names) <= _LISTED else ""


def explain(error: ValidationError, model: type[BaseModel]) -> str:
    """Return the first problem of a validation as one sentence."""
    detail = error.errors()[0]
    path = [str(part) for part in detail["loc"]]
    where = ".".join(["mock", *path])
    if detail["type"] == "extra_forbidden":
        owner = _model_at(model, path[:-1])
        hint = suggestion(path[-1], owner.model_fields) if owner else ""
        return f"unknown key {where}{hint}"
    message = detail["msg"].removeprefix("Value error, ")
    if message[1:2].islower():
        message = message[0].lower() + message[1:]
    return f"{where}: {message} (got {detail['input']!r:.60})"


def _model_at(model: type[BaseModel], path: list[str]) -> type[BaseModel] | None:
    """Return the model that a path of keys leads to, None if none does.

    Positions in lists lead nowhere new; in a union, the path names the member's ``kind``.
    """
    candidates = [model]
    for key in path:
        tagged = [each for each in candidates if key in _kinds(each)]
        if tagged:
            candidates = tagged
        elif len(candidates) == 1 and key in candidates[0].model_fields:
            candidates = list(_models_of(candidates[0].model_fields[key].annotation))
    return candidates[0] if len(candidates) == 1 else None


def _kinds(model: type[BaseModel]) -> tuple[str, ...]:
    field = model.model_fields.get("kind")
    return typing.get_args(field.annotation) if field else ()


def _models_of(annotation: Any) -> Iterable[type[BaseModel]]:
    """Yield the models that a type hint mentions."""
    arguments = typing.get_args(annotation)
    if arguments:
        for argument in arguments:
            yield from _models_of(argument)
    elif isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
