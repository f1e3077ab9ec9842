"""Reading YAML that may be anything: a bounded file, its numbers as YAML 1.2 has them, no aliases.

Its own reader, as a judge's should be: it shares nothing with the program it judges.
"""

import os
import re
import stat
from pathlib import Path
from typing import Any

import yaml

_MOST_BYTES = 250_000
_MOST_NODES = 6000
_DEEPEST = 20
_LONGEST = 5000  # characters of a value

_PLAIN = {
    "bool": r"true|True|TRUE|false|False|FALSE",
    "null": r"~|null|Null|NULL|",
    "int": r"[-+]?[0-9]{1,40}",
    "float": r"[-+]?(?:\.[0-9]+|[0-9]+\.?[0-9]*)(?:[eE][-+]?[0-9]+)?|[-+]?\.inf|\.nan",
}


class _Loader(yaml.SafeLoader):
    """Plain YAML 1.2 values; refuses what grows."""

    yaml_implicit_resolvers = {}  # noqa: RUF012  as the base class has it

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self._nodes = 0
        self._depth = 0

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        """Compose one node, if there is still room for it."""
        event: Any = self.peek_event()  # type: ignore[no-untyped-call]
        self._nodes += 1
        self._depth += 1
        if isinstance(event, yaml.AliasEvent) or getattr(event, "tag", None) is not None:
            raise yaml.YAMLError("aliases and tags are not read")
        if self._nodes > _MOST_NODES or self._depth > _DEEPEST:
            raise yaml.YAMLError("too many values, or nested too deeply")
        if isinstance(event, yaml.ScalarEvent) and len(event.value) > _LONGEST:
            raise yaml.YAMLError("a value is too long")
        node = super().compose_node(parent, index)
        self._depth -= 1
        return node

    def construct_decimal(self, node: yaml.ScalarNode) -> int:
        """A whole number; a leading zero makes no octal of it."""
        return int(self.construct_scalar(node))


for _name, _pattern in _PLAIN.items():
    _Loader.add_implicit_resolver(
        f"tag:yaml.org,2002:{_name}", re.compile(f"(?:{_pattern})$"), None
    )
_Loader.add_constructor("tag:yaml.org,2002:int", _Loader.construct_decimal)


def load_yaml(path: Path) -> Any:
    """The document in a file.

    Raises:
        OSError: the file cannot be read.
        ValueError: it is no regular file, too large, or not text.
        yaml.YAMLError: it is not YAML, or out of bounds.
    """
    with os.fdopen(os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC), "rb") as file:
        if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
            raise ValueError("is not a regular file")
        content = file.read(_MOST_BYTES + 1)
    if len(content) > _MOST_BYTES:
        raise ValueError(f"is larger than {_MOST_BYTES // 1000} kB")
    return yaml.load(content.decode("utf-8-sig"), _Loader)
