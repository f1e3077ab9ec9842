"""Configuration files: refused in one sentence, or accepted and then fit to make a flight of."""

import asyncio
import contextlib
import io
from math import inf, isfinite
from pathlib import Path
from typing import Any
from unittest import mock

from hypothesis import strategies as st

from companion import attitude
from companion.attitude import BodyRates
from companion.cli.main import main
from companion.config import Config
from companion.config.files import load
from companion.control.inner_loop import planner, rate_limits
from companion.control.outer_loop import predictive_settings
from companion.files.yaml_file import ConfigError
from companion.flight.assembly import assemble
from companion.flight.changes import Changes
from companion.flight.environment import THIS_COMPUTER
from companion.flight.observer import EventRecorder, SilentObserver
from companion.flight.opening import link_settings
from companion.flight.plan import ConfiguredPlan
from companion.vehicle.link import Link
from tests.fuzz import trajectories
from tests.fuzz.target import Case, Target
from tests.fuzz.texts import PATHS, SHIPPED, as_text, folder_of, mutated, numbers, scalars

_LONGEST_MESSAGE = 20_000
"""Characters of an error that a user is still to read, where every key of a file is wrong."""

_SCHEMA: dict[str, Any] = Config.model_json_schema()
_SECTIONS: dict[str, dict[str, Any]] = {
    name: _SCHEMA["$defs"][field["$ref"].rsplit("/", 1)[1]]["properties"]
    for name, field in _SCHEMA["properties"].items()
    if "$ref" in field
}


def _check(case: Case) -> None:
    with folder_of(case) as folder:
        errors = io.StringIO()
        with (
            contextlib.redirect_stderr(errors),
            contextlib.redirect_stdout(io.StringIO()),
            mock.patch("companion.cli.config.check_mock"),  # a process of its own
        ):
            code = main(["check-config", str(folder / "main.yaml")])
        said = errors.getvalue()
        assert code in (0, 2), f"exit {code}: {said[:2000]}"
        if code == 2:
            one_sentence(said)
            return
        _fly_nothing(load(folder / "main.yaml"), folder)


def one_sentence(said: str) -> None:
    """See that what a user is told is one line, not too long, and no internal error."""
    assert said.startswith("companion: "), said[:2000]
    assert said.count("\n") == 1, f"more than a line: {said[:2000]!r}"
    assert "internal error" not in said
    assert len(said) < _LONGEST_MESSAGE, f"{len(said)} characters: {said[:200]!r}…"


def _fly_nothing(config: Config, folder: Path) -> None:
    """Make all the parts of a flight, and ask the planner for rates."""
    if config.guidance.kind == "nmpc":
        with contextlib.suppress(ConfigError):  # as `fly` says it, before anything is begun
            predictive_settings(config)
    without = config.model_copy(
        update={"guidance": config.guidance.model_copy(update={"kind": "linear"})}
    )
    asyncio.run(_assembled(without, folder))
    limits, law = rate_limits(config), planner(config)
    limit_rates(law.rates((1.0, 0.0, 0.0, 0.0), attitude.Target(0.3, -0.1, 1.0), 0.02), limits)
    level = attitude.Target(0.0, 0.0, 0.0)
    limit_rates(law.rates((0.8, 0.6, 0.0, 0.0), level, 0.004, BodyRates(1.0, 0.0, 0.0)), limits)


async def _assembled(config: Config, folder: Path) -> None:
    async def ask() -> bool:
        return False

    link = Link(link_settings(config), None)
    recorder = EventRecorder(SilentObserver(), asyncio.get_running_loop().time, lambda _: None)
    plan, changes = ConfiguredPlan(config), Changes(config)
    assembled = assemble(config, link, recorder, ask, folder, plan, THIS_COMPUTER, changes)
    assert 0.0 < assembled.context.maneuvers.duration < inf
    assembled.close()


def limit_rates(rates: BodyRates, limits: Any) -> None:
    """See that rates are finite and no more than the limits allow."""
    roll, pitch, yaw = rates
    assert all(map(isfinite, rates)), rates
    assert (roll * roll + pitch * pitch) ** 0.5 <= limits.max_tilt_rate * (1 + 1e-9), rates
    assert abs(yaw) <= limits.max_yaw_rate * (1 + 1e-9), rates


def _value(field: dict[str, Any]) -> st.SearchStrategy[str]:
    """Text for a key: what the schema allows, its bounds, or anything."""
    kinds = [field, *field.get("anyOf", ())]
    known: list[st.SearchStrategy[Any]] = [
        st.sampled_from(next(kind["enum"] for kind in kinds if "enum" in kind))
        if any("enum" in kind for kind in kinds)
        else numbers
    ]
    for kind in kinds:
        bounds = [kind[key] for key in ("minimum", "maximum") if key in kind]
        bounds += [kind[key] for key in ("exclusiveMinimum", "exclusiveMaximum") if key in kind]
        if bounds:
            near = [change(bound) for bound in bounds for change in _NEAR]
            known.append(st.sampled_from(near))
            known.append(st.floats(min(bounds), max(*bounds, 100.0)))
        if kind.get("type") == "array":
            known.append(_LISTS)
        if kind.get("format") == "path":
            known.append(st.sampled_from(PATHS))
        if kind.get("type") == "boolean":
            known.append(st.booleans())
    return st.one_of(st.one_of(known).map(_yaml_text), scalars)


_NEAR = (float, int, lambda b: b * 1.000001, lambda b: b * 0.999999, lambda b: -b)
_LISTS = st.one_of(
    st.lists(st.lists(st.one_of(numbers, st.floats(-20.0, 20.0)), max_size=3), max_size=5),
    st.lists(
        st.sampled_from(("hover", "steps", "circle", "corners", "identify", "trajectory")),
        max_size=4,
    ),
    st.lists(st.integers(0, 9), max_size=3),
)


def _yaml_text(value: Any) -> str:
    match value:
        case bool():
            return "true" if value else "false"
        case float() if not isfinite(value):
            return {inf: ".inf", -inf: "-.inf"}.get(value, ".nan")
        case list():
            return "[" + ", ".join(map(_yaml_text, value)) + "]"
        case _:
            return str(value)


@st.composite
def _by_schema(draw: Any) -> str:
    """Some keys of some sections, most of them with values of the right kind."""
    lines = []
    for section in draw(st.lists(st.sampled_from(sorted(_SECTIONS)), max_size=4, unique=True)):
        keys = _SECTIONS[section]
        lines.append(f"{section}:")
        for key in draw(st.lists(st.sampled_from(sorted(keys)), max_size=4, unique=True)):
            lines.append(f"  {key}: {draw(_value(keys[key]))}")
    if draw(st.integers(0, 5)) == 0:
        lines.insert(0, f"include: {draw(st.one_of(st.sampled_from(PATHS), scalars))}")
    if draw(st.integers(0, 9)) == 0:
        lines.append(f"{draw(scalars)}: {draw(scalars)}")
    return "\n".join(lines) + "\n"


_LARGE = {
    "depth": lambda size: "a: " + "[" * size + "]" * size,
    "open": lambda size: "link: " + "{a: " * size,
    "block": lambda size: "a:\n" + "".join(" " * k + "a:\n" for k in range(min(size, 1000))),
    "keys": lambda size: "mock:\n" + "".join(f"  k{k}: {k}\n" for k in range(size)),
    "wrong keys": lambda size: "link:\n" + "".join(f"  k{k}: {k}\n" for k in range(size)),
    "aliases": lambda size: (
        "a0: &a0 [x]\n"
        + "".join(f"a{k}: &a{k} [*a{k - 1}, *a{k - 1}]\n" for k in range(1, min(size, 30)))
    ),
    "merges": lambda size: (
        "a0: &a0 {x: 1}\n"
        + "".join(f"a{k}: &a{k} {{<<: [*a{k - 1}, *a{k - 1}]}}\n" for k in range(1, min(size, 30)))
    ),
    "digits": lambda size: f"link: {{endpoint: {'9' * size * 10}}}\n",
    "escapes": lambda size: 'link: {endpoint: "' + "\\x41" * size + '"}\n',
    "lines": lambda size: 'link: {endpoint: "' + "\n" * size + '"}\n',
}
"""What costs a reader more than it looks, by its size."""
_pathological = st.builds(
    lambda kind, size: _LARGE[kind](size),
    st.sampled_from(sorted(_LARGE)),
    st.sampled_from((3, 30, 100, 1000, 5000, 20_000)),
)

_WHOLE = [path.read_text(encoding="utf-8") for path in sorted(SHIPPED.glob("*.yaml"))]
_PARTS = sorted(
    {
        f"{part.strip()}\n"
        for whole in _WHOLE
        for part in whole.replace("\n\n", "\n").split("\n#")
        if ":" in part
    }
)
_originals = st.one_of(
    st.lists(st.sampled_from(_PARTS), min_size=1, max_size=3).map("".join),
    st.sampled_from([text for text in _WHOLE if len(text) < 2000]),
)
_texts = st.one_of(
    _by_schema(),
    _by_schema(),
    mutated(_originals),
    mutated(_by_schema()),
    _pathological,
    st.binary(max_size=80).map(as_text),
    st.text(max_size=80),
)


@st.composite
def _cases(draw: Any) -> Case:
    files = {"main.yaml": draw(_texts)}
    if "other.yaml" in files["main.yaml"]:
        files["other.yaml"] = draw(st.one_of(_by_schema(), trajectories.yaml_texts))
    return files


TARGET = Target("configuration", _cases(), _check)
