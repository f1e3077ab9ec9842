"""Files that people and programs might write: mutated ones, and scalars that YAML reads oddly."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from hypothesis import strategies as st

SHIPPED = Path(__file__).parents[2] / "configs"

SCALARS = (
    *("0", "-0.0", "1", "-1", "0.5", "1e3", "5e-324", "1e308", "-1e308", "1e999", "1e-300"),
    *(".inf", "-.inf", ".nan", "010", "0o17", "0x1F", "0b11", "1_000", "1:30", "+1", "1.", ".5"),
    *("true", "no", "yes", "null", "~", "''", '"a\\0b"', "'12'", "2020-01-01", "[1, 2]", "{}"),
    *("2020-99-99", "2001-12-14t21:59:43.10-05:00", "!!int 'abc'", "!!float x", "!!binary x"),
    *("!!python/object:os.system x", "!!timestamp x", "!!bool x", "!!set {a}", "!!omap [a]"),
    *("*nowhere", "&a [*a]", "&a {b: *a}", "{[1]: 2}", "{{}: 1}", "? [a]", "<<", "<<: 1", "="),
    *("9" * 5000, "-" + "9" * 400, "0." + "1" * 3000, "x" * 20_000, "[" * 3000, "{a: " * 3000),
    *("é", "\u2028", "\ufeff", "\t", "|", "> x", "- a", "---", "...", "%YAML 9.9", "@", "`"),
)
"""Text after `key: `, among it all kinds that YAML 1.1 and 1.2 read differently."""

PATHS = (
    *("other.yaml", "main.yaml", "table.csv", "missing", ".", "..", "/", "", " ", "~"),
    *("/dev/null", "/dev/zero", "/dev/full", "/proc/self/mem", "fifo", "loop", "x" * 300),
)
"""Names of files, among them what is no file: see `folder_of`."""

numbers = st.one_of(
    st.floats(width=64),
    st.floats(0.0, 100.0),
    st.floats(-1000.0, 1000.0),
    st.integers(-10, 2000),
    st.sampled_from((0.0, 1e-12, 1e-300, 5e-324, 1e300, 1e308, 1e9, 10_000.0, 1000.0, 3600.0)),
)
scalars = st.one_of(numbers.map(repr), st.sampled_from(SCALARS), st.text(max_size=12))


@contextmanager
def folder_of(files: dict[str, str]) -> Iterator[Path]:
    """A folder with these files in it, a pipe without a writer, and a link that names itself."""
    with tempfile.TemporaryDirectory(prefix="fuzz-") as name:
        folder = Path(name)
        for file, text in files.items():
            (folder / file).write_bytes(as_bytes(text))
        os.mkfifo(folder / "fifo")
        (folder / "loop").symlink_to("loop")
        yield folder


def as_text(data: bytes) -> str:
    """Bytes as the text of a case; those that are no UTF-8 become lone surrogates."""
    return data.decode("utf-8", "surrogateescape")


def as_bytes(text: str) -> bytes:
    """The reverse of `as_text`; a surrogate that stands for no byte is written as it is."""
    try:
        return text.encode("utf-8", "surrogateescape")
    except UnicodeEncodeError:
        return text.encode("utf-8", "surrogatepass")


@st.composite
def mutated(draw: Any, originals: st.SearchStrategy[str]) -> str:
    """A text with some of its parts cut, doubled, swapped or replaced."""
    text = draw(originals)
    for _ in range(draw(st.integers(1, 6))):
        start = draw(st.integers(0, len(text)))
        end = min(len(text), start + draw(st.integers(0, 40)))
        match draw(st.sampled_from(("cut", "double", "replace", "number", "bytes", "move"))):
            case "cut":
                part = ""
            case "double":
                part = text[start:end] * draw(st.integers(2, 4))
            case "replace":
                part = draw(st.sampled_from(SCALARS))
            case "number":
                part = repr(draw(numbers))
            case "bytes":
                part = as_text(draw(st.binary(max_size=8)))
            case _:
                other = draw(st.integers(0, len(text)))
                part = text[other : other + 40]
        text = text[:start] + part + text[end:]
    return text
