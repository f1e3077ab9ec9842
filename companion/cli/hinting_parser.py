"""A parser of the command line that says what a wrong argument was probably meant to be."""

import argparse
from collections.abc import Sequence
from typing import Any, NoReturn

from companion.files.similar_names import name_hint

_CONFIG = "--config"


class HintingParser(argparse.ArgumentParser):
    """An `ArgumentParser` whose errors suggest an option; its commands are parsed by such, too."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self._typed: list[str] = []

    def parse_known_args(  # type: ignore[override]  # argparse's own overloads
        self, args: Sequence[str] | None = None, namespace: argparse.Namespace | None = None
    ) -> tuple[argparse.Namespace, list[str]]:
        """As in `ArgumentParser`, but the command itself refuses what it does not know.

        argparse would leave this to the top-level parser, whose usage lists no option of the
        command.
        """
        self._typed = list(args or ())
        options, unknown = super().parse_known_args(args, namespace)
        if unknown:
            self.error(f"unrecognized arguments: {' '.join(unknown)}")
        return options, unknown

    def error(self, message: str) -> NoReturn:
        """Print usage and message with a suggestion, and end the program."""
        is_about_a_value = message.startswith("argument ")
        super().error(message if is_about_a_value else message + self._hint())

    def _hint(self) -> str:
        known = [name for name in self._option_string_actions if name.startswith("--")]
        names = [word.partition("=")[0] for word in self._typed]
        for name in names:
            is_option = name.startswith("--") and name != "--"
            if is_option and not any(each.startswith(name) for each in known):
                return name_hint(name, known)
        if _CONFIG in known and _CONFIG not in names:
            for word, previous in zip(self._typed, ("", *self._typed), strict=False):
                if word.endswith((".yaml", ".yml")) and not self._takes_value(previous):
                    return f"; did you mean {_CONFIG} {word}?"
        return ""

    def _takes_value(self, word: str) -> bool:
        action = self._option_string_actions.get(word)
        return action is not None and action.nargs != 0
