"""Reads untrusted YAML: limited size, numbers as in YAML 1.2, no aliases, no tags.

The mock has its own reader because it shares no code with the program it tests.
"""

import os
import re
import stat
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import yaml

_MAX_BYTES = 250_000
_MAX_NODES = 6000
_MAX_NESTING = 20
"""Largest number of nested levels."""
_MAX_VALUE_LENGTH = 5000  # characters of a value

_SCALAR_PATTERNS = {
    "bool": r"true|True|TRUE|false|False|FALSE",
    "null": r"~|null|Null|NULL|",
    "int": r"[-+]?[0-9]{1,40}",
    "float": r"[-+]?(?:\.[0-9]+|[0-9]+\.?[0-9]*)(?:[eE][-+]?[0-9]+)?|[-+]?\.inf|\.nan",
}


class _Loader(yaml.SafeLoader):
    """Loads plain YAML 1.2 values; refuses aliases, tags and large documents."""

    yaml_implicit_resolvers = {}  # noqa: RUF012  as the base class has it

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self._node_count = 0
        self._depth = 0

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        """Compose one node.

        Raises:
            yaml.YAMLError: an alias or a tag, too many or too deeply nested values, or a value
                that is too long.
        """
        event: Any = self.peek_event()  # type: ignore[no-untyped-call]
        self._node_count += 1
        self._depth += 1
        if isinstance(event, yaml.AliasEvent) or getattr(event, "tag", None) is not None:
            raise yaml.YAMLError("aliases and tags are not supported")
        if self._node_count > _MAX_NODES or self._depth > _MAX_NESTING:
            raise yaml.YAMLError("too many values, or nested too deeply")
        if isinstance(event, yaml.ScalarEvent) and len(event.value) > _MAX_VALUE_LENGTH:
            raise yaml.YAMLError("a value is too long")
        node = super().compose_node(parent, index)
        self._depth -= 1
        return node

    def construct_decimal(self, node: yaml.ScalarNode) -> int:
        """Return an integer in decimal; a leading zero does not make it octal."""
        return int(self.construct_scalar(node))


for _name, _pattern in _SCALAR_PATTERNS.items():
    _Loader.add_implicit_resolver(
        f"tag:yaml.org,2002:{_name}", re.compile(f"(?:{_pattern})$"), None
    )
_Loader.add_constructor("tag:yaml.org,2002:int", _Loader.construct_decimal)


class FileRefusedError(Exception):
    """The file is not regular, too large, or not text; the message says which."""


class Document(NamedTuple):
    """A YAML document."""

    value: Any
    """The document as plain Python values."""
    node: yaml.Node | None
    """The document as YAML nodes with line numbers."""

    def line(self, path: Sequence[str]) -> int | None:
        """Return the line (from 1) of the deepest key of this path that the document contains."""
        node, line = self.node, None
        for part in path:
            if isinstance(node, yaml.MappingNode):
                key_and_value = {key.value: (key, value) for key, value in node.value}.get(part)
            elif isinstance(node, yaml.SequenceNode) and part.isdigit():
                item = node.value[int(part)] if int(part) < len(node.value) else None
                key_and_value = None if item is None else (item, item)
            else:
                break
            if key_and_value is not None:  # a part may name the member of a union instead
                line, node = key_and_value[0].start_mark.line + 1, key_and_value[1]
        return line


def load_yaml(path: Path) -> Document:
    """Return the document in a file.

    Raises:
        OSError: the file cannot be read.
        FileRefusedError: the file is not regular, too large, or not text.
        yaml.YAMLError, ValueError, TypeError, OverflowError: the content is not YAML, or exceeds a
            limit.
    """
    with os.fdopen(os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC), "rb") as file:
        if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
            raise FileRefusedError("is not a regular file")
        content = file.read(_MAX_BYTES + 1)
    if len(content) > _MAX_BYTES:
        raise FileRefusedError(f"is larger than {_MAX_BYTES // 1000} kB")
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise FileRefusedError("is not text in UTF-8") from error
    loader = _Loader(text)
    try:
        node = loader.get_single_node()
        value = None if node is None else loader.construct_document(node)
    finally:
        loader.dispose()
    return Document(value, node)


def explain_yaml(error: Exception) -> str:
    """Return why a file cannot be read as YAML, on one line."""
    position = getattr(error, "problem_mark", None)
    if position is not None and "'\\t'" in str(getattr(error, "problem", "")):
        return (
            f"line {position.line + 1}: a tab is used where YAML requires spaces; indent with "
            "two spaces for each level"
        )
    problem = " ".join(str(error).split())
    return f"is not valid YAML: {problem:.300}"
