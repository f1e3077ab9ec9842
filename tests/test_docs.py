"""README.md and the pages of docs/: links, command lines, quoted messages and keys are real."""

import ast
import re
import shlex
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from dataclasses import fields
from functools import cache
from itertools import pairwise
from pathlib import Path

import pytest

from companion.cli import command_line
from companion.config import Config
from companion.config.files import load
from companion.mavlink.stats import LinkStats
from companion.preflight.finding import Key
from companion.safety import monitors
from sitl_mock.settings import load_settings

ROOT = Path(__file__).parents[1]
README = ROOT / "README.md"
INDEX = ROOT / "docs/index.md"
PAGES = [README, ROOT / "examples/README.md", *sorted((ROOT / "docs").glob("*.md"))]
MOST_WORDS = 900  # of README.md: it is read in five minutes

BLOCK = re.compile(r"^[ \t]*```(\w*)(?: title=[^\n]*)?\n(.*?)^[ \t]*```$", re.MULTILINE | re.DOTALL)
INLINE = re.compile(r"`([^`\n]+)`")
LINK = re.compile(r"\]\(([^)\s]+)\)")
COMMAND = re.compile(r"(\.venv/bin/)?companion (?=--|[a-z])")
HEADING = re.compile(r"^#+ +(.+)$", re.MULTILINE)


def named(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


each_page = pytest.mark.parametrize("page", PAGES, ids=named)


def prose(page: Path) -> str:
    return BLOCK.sub("", page.read_text("utf-8"))


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
        for language, block in BLOCK.findall(text)
        if language in ("sh", "bash", "shell", "console")
        for line in block.replace("\\\n", " ").splitlines()
    ]
    lines += [code for code in INLINE.findall(BLOCK.sub("", text)) if "…" not in code]
    for line in lines:
        if COMMAND.match(line):
            yield shlex.split(line, comments=True)[1:]


def complaint(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> str | None:
    """What the parser says against these arguments; without options they only name a command."""
    only_named = all(re.fullmatch(r"[a-z][a-z0-9-]*", word) for word in arguments)
    try:
        command_line.parse([*arguments, "--help"] if only_named else arguments)
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
        if known and re.fullmatch(r"[a-z0-9_]+", key) and key not in ("tlog", "mcap", "yaml"):
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


def test_every_extra_of_users_is_in_the_table_of_extras() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    page = (ROOT / "docs/getting-started.md").read_text("utf-8")
    listed = re.findall(r"^\| `(\w+)` \| ", page.split("| extra | for |")[1].split("\n\n")[0], re.M)
    assert set(listed) == set(project["optional-dependencies"]) - {"test", "mutants"}


def test_whole_configurations_on_pages_can_be_flown(tmp_path: Path) -> None:
    """A block that begins with `include:` is a file beside the shipped ones."""
    shutil.copytree(ROOT / "configs", tmp_path, dirs_exist_ok=True)
    texts = [text for page in PAGES for _, text in BLOCK.findall(page.read_text("utf-8"))]
    whole = [text for text in texts if text.startswith("include:") and "\nmock:" in text]
    assert whole
    for text in whole:
        (tmp_path / "page.yaml").write_text(text, encoding="utf-8")
        assert load(tmp_path / "page.yaml").flight.arm
        assert load_settings(tmp_path / "page.yaml", {}).faults


def test_every_page_is_in_the_index() -> None:
    listed = {link.partition("#")[0] for link in LINK.findall(INDEX.read_text("utf-8"))}
    pages = {page.name for page in PAGES if page.parent.name == "docs" and page != INDEX}
    assert pages <= listed, f"docs/index.md does not list {sorted(pages - listed)}"


def test_the_site_has_every_page_in_the_order_of_the_index() -> None:
    site = tomllib.loads((ROOT / "zensical.toml").read_text("utf-8"))["project"]
    first, *sections = site["nav"]
    pages = [page for section in sections for group in section.values() for page in group]
    assert list(first.values()) == ["index.md"]
    linked = [link for link in LINK.findall(INDEX.read_text("utf-8")) if link.endswith(".md")]
    assert pages == linked


@cache
def nodes_of_the_program() -> dict[Path, list[ast.AST]]:
    """The syntax of `companion` by file; only what speaks is kept: texts, `raise`, `return`."""
    kept = ast.Constant | ast.JoinedStr | ast.Raise | ast.Return
    return {
        file: [each for each in ast.walk(ast.parse(file.read_bytes())) if isinstance(each, kept)]
        for file in (ROOT / "companion").rglob("*.py")
    }


@cache
def texts_of_the_program() -> str:
    """Every text in `companion`; a value within a text stands as `\\0`."""
    found = []
    for nodes in nodes_of_the_program().values():
        for node in nodes:
            if isinstance(node, ast.JoinedStr):
                parts = (getattr(part, "value", "") for part in node.values)
                found.append("".join(part if isinstance(part, str) else "\0" for part in parts))
            elif isinstance(node, ast.Constant) and isinstance(node.value, str):
                found.append(node.value)
    return "\n".join(found)


TROUBLESHOOTING = (ROOT / "docs/troubleshooting.md").read_text("utf-8")


def pattern(message: str) -> str:
    """A message of a page as a regular expression; `…` stands for what is filled in."""
    return r"[^\n]*".join(re.escape(part) for part in message.split("…"))


def test_messages_of_troubleshooting_are_said() -> None:
    """Each heading there quotes a message, and so does each row of its tables of messages."""
    headings = re.findall(r"^### `(.+)`$", TROUBLESHOOTING, re.MULTILINE)
    findings = TROUBLESHOOTING.index("## Every finding of the doctor")
    rows = re.findall(r"^\| `(.+?)` \|", TROUBLESHOOTING[:findings], re.MULTILINE)
    assert len(headings) >= 20
    assert len(rows) >= 60
    for message in (*headings, *rows):
        found = re.search(pattern(message), texts_of_the_program())
        assert found, f"nothing says {message!r}"


ENDINGS = {"FlightEnded", "EndpointError", "LinkError", "UnsupportedAutopilot", "CommandTimeout"}
NOT_FOR_USERS = (
    "lockstep needs the event loop",
    "a signing key",
    "mock vehicle",  # of companion.testing
    "…: mode …",  # who took over; its two beginnings have rows of their own
)


def texts(node: ast.AST | None) -> Iterator[str]:
    """The text of an expression; values in it stand as `…`."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        yield node.value
    elif isinstance(node, ast.JoinedStr):
        parts = (getattr(part, "value", "…") for part in node.values)
        yield "".join(part if isinstance(part, str) else "…" for part in parts)


def raised_and_checked() -> Iterator[str]:
    """What ends a flight: texts of its exceptions, and what the checks of monitors return."""
    for file, nodes in nodes_of_the_program().items():
        is_check = file.name.endswith("_breaches.py")
        for node in nodes:
            if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call):
                if getattr(node.exc.func, "id", "") in ENDINGS and node.exc.args:
                    yield from texts(node.exc.args[0])
            elif is_check and isinstance(node, ast.Return):
                value = node.value
                for one in (value.body, value.orelse) if isinstance(value, ast.IfExp) else (value,):
                    yield from texts(one)


def test_whatever_ends_a_flight_is_in_troubleshooting() -> None:
    quoted = re.findall(r"^(?:### |\| )`(.+?)`(?: \||$)", TROUBLESHOOTING, re.MULTILINE)
    patterns = [re.compile(pattern(message)) for message in quoted]
    messages = {text for text in raised_and_checked() if text.strip("… :")}
    assert len(messages) > 40
    missing = [
        message
        for message in sorted(messages)
        if not any(one.search(message) for one in patterns)
        and not any(part in message for part in NOT_FOR_USERS)
    ]
    assert not missing, "\n".join(missing)


def test_every_finding_is_in_troubleshooting() -> None:
    listed = set(re.findall(r"^\| `([\w.]+)` \|", TROUBLESHOOTING, re.MULTILINE))
    assert {key.value for key in Key} <= listed


SAFETY = (ROOT / "docs/safety.md").read_text("utf-8")


def test_the_monitors_of_the_safety_page_are_those_of_the_table() -> None:
    """Name, how long a breach lasts, and the action; the watch itself judges the first two."""
    rows = re.findall(
        r"^\| ([a-z ]+?) \| .+ \| (at once|[\d.]+ s) \| ([a-z_]+)", SAFETY, re.MULTILINE
    )
    shown = {
        name: (0.0 if raise_after == "at once" else float(raise_after[:-2]), action)
        for name, raise_after, action in rows
    }
    assert (shown.pop("takeover"), shown.pop("mode unknown")) == (
        (0.0, "release"),
        (0.0, "listen"),
    )
    assert shown == {one.name: (one.raise_after, one.action.value) for one in monitors(Config())}


def test_the_tests_that_pages_name_exist() -> None:
    files = list((ROOT / "tests").rglob("*.py"))
    for page in PAGES:
        for name, cases in re.findall(
            r"`((?:tests/[\w/]*)?test_\w+\.py)`( [\w, ]+(?= \|))?", page.read_text("utf-8")
        ):
            (path,) = [one for one in files if one.as_posix().endswith(f"/{name}")] or [None]
            assert path, f"{named(page)}: there is no {name}"
            for case in filter(None, cases.replace(" ", "").split(",")):
                assert case in path.read_text("utf-8"), f"{named(page)}: {name} has no {case}"


def test_formulas_are_closed() -> None:
    for page in PAGES:
        text = INLINE.sub("", prose(page))
        assert text.count("$$") % 2 == 0, named(page)
        assert text.replace("$$", "").count("$") % 2 == 0, named(page)


def test_the_site_is_built_without_a_warning(tmp_path: Path) -> None:
    """As `make docs` builds it, from a copy; each formula of the law becomes MathML."""
    for module in ("zensical", "l2m4m"):  # of the extra `docs`, which `make test` installs
        pytest.importorskip(module)
    shutil.copytree(ROOT / "docs", tmp_path / "docs")
    shutil.copy(ROOT / "zensical.toml", tmp_path)
    command = [sys.executable, "-m", "zensical", "build", "--strict", "--clean"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "warning" not in (done.stdout + done.stderr).lower()
    page = (tmp_path / "site/the-law/index.html").read_text("utf-8")
    formulas = (ROOT / "docs/the-law.md").read_text("utf-8").count("$$") // 2
    assert formulas > 10
    assert page.count('<math display="block"') == formulas
    assert "$$" not in page
    assert not re.search(r'(src|href)="https?://(?!zensical\.org)', page), "loads from elsewhere"
