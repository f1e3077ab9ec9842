"""README.md and the pages of docs/: links, command lines, quoted messages and keys are real."""

import ast
import re
import shlex
import tomllib
from collections.abc import Iterator
from dataclasses import fields
from functools import cache
from itertools import pairwise
from pathlib import Path

import pytest

from companion.cli import command_line
from companion.config import Config
from companion.mavlink.stats import LinkStats
from companion.preflight.finding import Key

ROOT = Path(__file__).parents[1]
README = ROOT / "README.md"
INDEX = ROOT / "docs/index.md"
PAGES = [README, *sorted((ROOT / "docs").glob("*.md"))]
MOST_WORDS = 900  # of README.md: it is read in five minutes

FENCE = re.compile(r"^[ \t]*```(\w*)\n(.*?)^[ \t]*```$", re.MULTILINE | re.DOTALL)
INLINE = re.compile(r"`([^`\n]+)`")
LINK = re.compile(r"\]\(([^)\s]+)\)")
COMMAND = re.compile(r"(\.venv/bin/)?companion (?=--|[a-z])")
HEADING = re.compile(r"^#+ +(.+)$", re.MULTILINE)


def named(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


each_page = pytest.mark.parametrize("page", PAGES, ids=named)


def prose(page: Path) -> str:
    return FENCE.sub("", page.read_text("utf-8"))


def anchors(page: Path) -> set[str]:
    """The anchors that GitHub and MkDocs make of the headings of a page."""
    titles = (title.lower() for title in HEADING.findall(prose(page)))
    return {re.sub(r"[^\w\- ]", "", title).strip().replace(" ", "-") for title in titles}


@each_page
def test_relative_links_resolve(page: Path) -> None:
    for link in LINK.findall(prose(page)):
        if "://" in link or link.startswith("mailto:"):
            continue
        path, _, anchor = link.partition("#")
        target = (page.parent / path).resolve() if path else page
        assert target.exists(), f"{named(page)}: {link} leads nowhere"
        if anchor:
            assert anchor in anchors(target), f"{named(page)}: {link} has no such heading"


def command_lines(text: str) -> Iterator[list[str]]:
    """The arguments of each `companion …` in a shell block, or as inline code with options."""
    lines = [
        line
        for language, block in FENCE.findall(text)
        if language in ("sh", "bash", "shell", "console")
        for line in block.replace("\\\n", " ").splitlines()
    ]
    lines += [code for code in INLINE.findall(FENCE.sub("", text)) if "…" not in code]
    for line in lines:
        if COMMAND.match(line):
            yield shlex.split(line, comments=True)[1:]


def complaint(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> str | None:
    """What the parser says against these arguments; without options they only name a command."""
    only_named = all(re.fullmatch(r"[a-z][a-z0-9-]*", word) for word in arguments)
    try:
        command_line._parser().parse_args([*arguments, "--help"] if only_named else arguments)
    except SystemExit as ended:
        said = capsys.readouterr().err
        if "arguments are required: --config" in said:  # an option named in the text
            return complaint([*arguments, "--config", "my.yaml"], capsys)
        return said if ended.code else None
    return None


@each_page
def test_command_lines_parse(page: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for arguments in command_lines(page.read_text("utf-8")):
        said = complaint(arguments, capsys)
        assert said is None, f"{named(page)}: companion {shlex.join(arguments)}\n{said}"


@each_page
def test_configurations_of_the_command_lines_exist(page: Path) -> None:
    for arguments in command_lines(page.read_text("utf-8")):
        for word in arguments:
            if word.startswith("configs/"):
                assert (ROOT / word).is_file(), f"{named(page)}: {word} does not exist"


@each_page
def test_keys_of_the_configuration_exist(page: Path) -> None:
    """`section.key` in the text or behind `--set` is a key, a file, a finding or a counter."""
    others = {*Key, *(f"link.{counter.name}" for counter in fields(LinkStats))}
    quoted = [re.split("[=:]", code)[0] for code in INLINE.findall(prose(page))]
    for arguments in command_lines(page.read_text("utf-8")):
        quoted += [b.split("=")[0] for a, b in pairwise(arguments) if a == "--set"]
    for name in quoted:
        section, _, key = name.partition(".")
        field = Config.model_fields.get(section)
        known = getattr(field and field.annotation, "model_fields", None)
        if known and re.fullmatch(r"[a-z0-9_]+", key) and key not in ("tlog", "yaml"):
            assert key in known or name in others, f"{named(page)}: there is no key `{name}`"


def test_readme_is_short() -> None:
    assert len(README.read_text("utf-8").split()) <= MOST_WORDS


def test_make_targets_exist() -> None:
    targets = set(re.findall(r"^([\w-]+):", (ROOT / "Makefile").read_text("utf-8"), re.MULTILINE))
    for page in PAGES:
        named_here = set(re.findall(r"`make ([a-z-]+)", page.read_text("utf-8")))
        if page.name == "real-autopilots.md":  # names targets of PX4's own Makefile, too
            continue
        assert named_here <= targets, f"{named(page)}: {named_here - targets}"


def test_every_page_is_in_the_index() -> None:
    listed = {link.partition("#")[0] for link in LINK.findall(INDEX.read_text("utf-8"))}
    pages = {page.name for page in PAGES if page not in (README, INDEX)}
    assert pages <= listed, f"docs/index.md does not list {sorted(pages - listed)}"


def test_the_site_has_every_page_in_the_order_of_the_index() -> None:
    site = tomllib.loads((ROOT / "zensical.toml").read_text("utf-8"))["project"]
    first, *sections = site["nav"]
    pages = [page for section in sections for group in section.values() for page in group]
    assert list(first.values()) == ["index.md"]
    assert pages == LINK.findall(INDEX.read_text("utf-8"))


@cache
def texts_of_the_program() -> str:
    """Every text in `companion`; a value within a text stands as `\\0`."""
    found = []
    for file in (ROOT / "companion").rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text("utf-8"))):
            if isinstance(node, ast.JoinedStr):
                parts = (getattr(part, "value", "") for part in node.values)
                found.append("".join(part if isinstance(part, str) else "\0" for part in parts))
            elif isinstance(node, ast.Constant) and isinstance(node.value, str):
                found.append(node.value)
    return "\n".join(found)


def test_messages_of_troubleshooting_are_said() -> None:
    """Each heading there quotes a message; `…` stands for what is filled in."""
    page = (ROOT / "docs/troubleshooting.md").read_text("utf-8")
    messages = re.findall(r"^### `(.+)`$", page, re.MULTILINE)
    assert len(messages) >= 20
    for message in messages:
        pattern = r"[^\n]*".join(re.escape(part) for part in message.split("…"))
        assert re.search(pattern, texts_of_the_program()), f"nothing says {message!r}"
