"""Scripts of what goes wrong in a flight: what `tests.fuzz.channel` is given to do."""

from typing import Any

from hypothesis import strategies as st

from tests.fuzz.family import ARDUPILOT, PX4
from tests.fuzz.messages import EVERY, KINDS

_PHASES = ("connect", "checks", "stream", "arm", "takeoff", "offboard", "maneuvers", "hand back")
_PHASES += ("land", "disarm")
_phases = st.sampled_from((*_PHASES, "takeoff", "offboard", "offboard", "maneuvers", "maneuvers"))
_values = st.one_of(
    st.sampled_from((0, 1, -1, 2, 3, 4, 5, 255, 65535, 2**31, 2**32 - 1, -(2**31), 2**63 - 1)),
    st.sampled_from((float("nan"), float("inf"), -float("inf"), 1e-40, 3.4e38, -3.4e38, 0.0)),
    st.floats(width=32),
    st.integers(-300, 300),
    st.floats(-50.0, 50.0).map(lambda by: {"add": by}),
)
_MODES = sorted({*PX4.ours, *PX4.foreign, *ARDUPILOT.ours, *ARDUPILOT.foreign, 2**32 - 1})
_OTHERS = (
    *("COMMAND_ACK", "PARAM_VALUE", "PARAM_ERROR", "TIMESYNC", "STATUSTEXT", "SYSTEM_TIME"),
    *("AUTOPILOT_VERSION", "HIGHRES_IMU", "ATTITUDE", "SET_ATTITUDE_TARGET", "COMMAND_LONG"),
)
"""Messages that the small vehicle does not send by itself."""
_FIELDS = {
    kind.msgname: tuple(kind.fieldnames)
    for kind in KINDS.values()
    if kind.msgname in EVERY or kind.msgname in _OTHERS
}
_seconds = st.one_of(st.floats(0.02, 3.0), st.sampled_from((0.03, 0.1, 0.3, 0.6, 1.2, 6.0)))
_ahead = st.sampled_from((1, 50, 1000, 60_000, 2**31, 2**32 - 30_000))
_sources = st.sampled_from(([1, 1], [1, 1], [1, 2], [2, 1], [255, 190]))


@st.composite
def _field(draw: Any) -> dict[str, Any]:
    name = draw(st.sampled_from(tuple(EVERY)))
    field = draw(st.sampled_from(_FIELDS[name]))
    return {"message": name, "field": field, "value": draw(_values), "seconds": draw(_seconds)}


@st.composite
def _say(draw: Any) -> dict[str, Any]:
    name = draw(st.sampled_from(sorted(_FIELDS)))
    fields = draw(st.dictionaries(st.sampled_from(_FIELDS[name]), _values, max_size=3))
    count = draw(st.sampled_from((1, 1, 2, 20)))
    return {"message": name, "fields": fields, "count": count, "source": draw(_sources)}


_some = st.lists(st.sampled_from(tuple(EVERY)), min_size=1, max_size=3, unique=True)
_arguments: dict[str, st.SearchStrategy[dict[str, Any]]] = {
    "field": _field(),
    "say": _say(),
    "silence": st.fixed_dictionaries(
        {"messages": st.one_of(st.none(), _some), "seconds": _seconds}
    ),
    "delay": st.fixed_dictionaries(
        {"by": st.sampled_from((0.01, 0.05, 0.12, 0.3, 1.0)), "seconds": _seconds}
    ),
    "hold": st.fixed_dictionaries({"seconds": _seconds}),
    "copies": st.fixed_dictionaries({"count": st.integers(0, 4), "seconds": _seconds}),
    "swap": st.fixed_dictionaries({"seconds": _seconds}),
    "deaf": st.fixed_dictionaries({"seconds": _seconds}),
    "stamps": st.fixed_dictionaries({"by_ms": st.one_of(_ahead, _ahead.map(lambda by: -by))}),
    "restart": st.just({}),
    "mode": st.fixed_dictionaries({"mode": st.sampled_from(_MODES)}),
    "armed": st.fixed_dictionaries({"armed": st.booleans()}),
    "ack": st.fixed_dictionaries(
        {
            "command": st.sampled_from((400, 176, 22, 21, 511, 512)),
            "result": st.sampled_from((0, 1, 2, 3, 4, 5, 6, 200)),
        }
    ),
    "jump": st.fixed_dictionaries({"by": st.lists(st.floats(-20.0, 20.0), min_size=3, max_size=3)}),
    "interrupt": st.just({}),
    "bytes": st.fixed_dictionaries({"hex": st.binary(max_size=40).map(bytes.hex)}),
    "event": st.fixed_dictionaries({"payload": st.binary(min_size=1, max_size=56).map(bytes.hex)}),
}
"""What each kind of event needs to be told."""
_kinds = st.sampled_from((*_arguments, "field", "field", "say", "silence"))


@st.composite
def _events(draw: Any) -> dict[str, Any]:
    """One thing that goes wrong."""
    kind = draw(_kinds)
    when = {"phase": draw(_phases), "after": draw(st.floats(0.0, 2.0))}
    return {**when, "kind": kind, **draw(_arguments[kind])}


cases = st.fixed_dictionaries(
    {
        "family": st.sampled_from(("px4", "ardupilot")),
        "arm": st.sampled_from((True, True, False)),
        "planner": st.sampled_from(("auto", "first-order", "exact", "quaternion", "so3", "euler")),
        "maneuvers": st.sampled_from((["hover"], ["hover"], ["steps"], ["circle"], ["corners"])),
        "events": st.lists(_events(), max_size=5),
    }
)
