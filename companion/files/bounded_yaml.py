"""YAML as plain values, read within bounds, so that no file costs much time or memory.

Unquoted values are read by the core schema of YAML 1.2: 010 is ten; 1:30, a date, yes, no, on and
off are texts. Tags and aliases are refused: our files do not need them, and a few lines of aliases
can expand to gigabytes.
"""

import re
from math import inf
from typing import Any, NamedTuple

import yaml

MOST_BYTES = 250_000
"""Largest size of a file, bytes. A thousand waypoints take 50 kB."""
MOST_NODES = 6000
"""Largest number of keys, values, lists and mappings together."""
DEEPEST_NESTING = 20
"""Largest nesting depth of lists and mappings."""
LONGEST_TEXT = 4096
"""Largest number of characters of a value."""
LONGEST_KEY = 100
"""Largest number of characters of a key."""
LONGEST_NUMBER = 40
"""Largest number of characters of a number."""

_CONSTANTS = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL")),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
}
_INTEGER = re.compile(r"[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+")
_FLOAT = re.compile(
    r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?"
    r"|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN)"
)
_CONTROL_CHARACTER = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f\ud800-\udfff]")


class YamlError(Exception):
    """A YAML text cannot be read.

    Args:
        problem: what is wrong.
        line: line number from 1; None if the fault is not on one line.
    """

    def __init__(self, problem: str, line: int | None = None) -> None:
        super().__init__(problem)
        self.line = line


KeyPath = tuple[str | int, ...]
"""Path to a value from the root of the document: keys, and positions in lists."""


class Document(NamedTuple):
    """A YAML document."""

    root: Any
    lines: dict[KeyPath, int]
    """The line on which each key and each item of a list stands, from 1."""


def parse(text: str) -> Any:
    """Parse a YAML text; return its value.

    Raises:
        YamlError: the text cannot be read; see `read`.
    """
    return read(text).root


def read(text: str) -> Document:
    """Read the single document in a YAML text: dicts with texts as keys, lists and scalars.

    Raises:
        YamlError: the text is not valid YAML, holds a key twice, an alias or a tag, or exceeds a
            limit of this module.
    """
    lines: dict[KeyPath, int] = {}
    try:
        composer = _Composer(text)
        root = composer.get_node() if composer.check_node() else None
        if composer.check_node():
            second_document: Any = composer.peek_event()  # type: ignore[no-untyped-call]
            raise YamlError("not valid YAML: more than one document", _line(second_document))
        value = None if root is None else _value(root, (), lines)
    except yaml.MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else None
        raise YamlError(_error_text(error, text), line) from error
    except yaml.reader.ReaderError as error:
        line = text.count("\n", 0, error.position) + 1
        raise YamlError(f"not valid YAML: {error.reason}", line) from error
    except (ValueError, OverflowError) as error:  # for example the escape "\\U99999999"
        raise YamlError(f"not valid YAML: {error}") from error
    return Document(value, lines)


def _error_text(error: yaml.MarkedYAMLError, text: str) -> str:
    """The error message, with a remedy for the most common mistakes."""
    problem = str(error.problem)
    lines, mark = text.splitlines(), error.problem_mark
    line = lines[mark.line] if mark and mark.line < len(lines) else ""
    if "\t" in line[: len(line) - len(line.lstrip())] or "'\\t'" in problem:
        return "a tab is used where YAML requires spaces; indent with two spaces for each level"
    if problem.startswith("mapping values are not allowed"):
        problem += "; a key is indented too far, or a line before it lacks its colon"
    return f"not valid YAML: {problem}"


def dump(data: dict[str, Any]) -> str:
    """YAML text of plain values that `parse` converts back to the same values."""
    return yaml.dump(data, Dumper=_Dumper, sort_keys=False)


def dump_value(value: Any) -> str:
    """YAML of one value on one line, as it stands after a key."""
    text = yaml.dump([value], Dumper=_Dumper, default_flow_style=True, width=inf)
    return str(text).strip()[1:-1]


class _Dumper(yaml.SafeDumper):
    """Quotes texts that YAML 1.1 or 1.2 would read as numbers: 12e5, 0o17."""

    def ignore_aliases(self, data: Any) -> bool:
        """Always true: no alias is written, because `parse` refuses aliases."""
        return True


for _pattern, _tag in ((_INTEGER, "int"), (_FLOAT, "float")):
    _Dumper.add_implicit_resolver(
        f"tag:yaml.org,2002:{_tag}", re.compile(f"(?:{_pattern.pattern})$"), list("-+.0123456789")
    )


class _Composer(yaml.BaseLoader):
    """Composes the nodes of a text within the limits; refuses aliases and tags."""

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self._nodes = self._depth = 0

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        """Compose a key or a value and all that is in it.

        Raises:
            YamlError: an alias, a tag, too many nodes, or a node that is nested too deeply.
        """
        event: Any = self.peek_event()  # type: ignore[no-untyped-call]
        line = _line(event)
        self._nodes += 1
        self._depth += 1
        if isinstance(event, yaml.AliasEvent):
            raise YamlError(f"write out what the alias *{event.anchor:.40} stands for", line)
        if self._nodes > MOST_NODES:
            raise YamlError(f"more than {MOST_NODES} keys and values", line)
        if event.tag is not None:
            raise YamlError(f"take out the tag {event.tag:.40}: tags are refused", line)
        if self._depth > DEEPEST_NESTING and isinstance(event, yaml.CollectionStartEvent):
            raise YamlError(f"nested deeper than {DEEPEST_NESTING} levels", line)
        self.anchors = {}  # without aliases, a second anchor of the same name is no mistake
        node = super().compose_node(parent, index)
        self._depth -= 1
        return node


def _line(node_or_event: Any) -> int:
    """The line, from 1, on which an event or a node begins."""
    return int(node_or_event.start_mark.line) + 1


def _value(node: yaml.Node, key_path: KeyPath, lines: dict[KeyPath, int]) -> Any:
    """The value of the node at a path; adds the lines of all keys and items in it to `lines`."""
    if isinstance(node, yaml.ScalarNode):
        return _scalar(node)
    if isinstance(node, yaml.SequenceNode):
        lines.update(
            {(*key_path, position): _line(item) for position, item in enumerate(node.value)}
        )
        return [
            _value(item, (*key_path, position), lines) for position, item in enumerate(node.value)
        ]
    section: dict[str, Any] = {}
    for key_node, value_node in node.value:
        key = _new_key(_value(key_node, key_path, {}), section, _line(key_node))
        lines[(*key_path, key)] = _line(key_node)
        section[key] = _value(value_node, (*key_path, key), lines)
    return section


def _new_key(key: Any, parent: dict[str, Any], line: int) -> str:
    if not isinstance(key, str):
        hint = "; a number has a point for decimals, not a comma" if parent else ""
        raise YamlError(f"a key must be a word, not {key!r:.40}{hint}", line)
    if len(key) > LONGEST_KEY:
        raise YamlError(f"the key {key[:20]!r}... is longer than {LONGEST_KEY} characters", line)
    if key in parent:
        raise YamlError(f"not valid YAML: the key {key!r} is given twice", line)
    return key


def _scalar(node: yaml.ScalarNode) -> Any:
    text, line = str(node.value), _line(node)
    if len(text) > LONGEST_TEXT:
        raise YamlError(f"a value is longer than {LONGEST_TEXT} characters", line)
    if _CONTROL_CHARACTER.search(text):
        raise YamlError("a value holds a control character", line)
    return _unquoted_value(text, line) if node.style is None else text


def _unquoted_value(text: str, line: int) -> Any:
    """The value of an unquoted text by the core schema of YAML 1.2."""
    if text in _CONSTANTS:
        return _CONSTANTS[text]
    integer_match = _INTEGER.fullmatch(text)
    if not integer_match and not _FLOAT.fullmatch(text):
        return text
    if len(text) > LONGEST_NUMBER:
        raise YamlError(f"a number is longer than {LONGEST_NUMBER} characters", line)
    if integer_match:
        return int(text, {"0o": 8, "0x": 16}.get(text[:2], 10))
    return float(text.replace(".", "", 1) if text.lstrip("+-")[1:2].isalpha() else text)
