"""Scenarios that fail until a point of the issue is mended: whoever mends it takes its lines away.

The key is "personality: name of the scenario"; `pytest.mark.xfail(strict=True)` says so when a mend
has made one pass.
"""

_SELDOM = "point 4: the rate of answers is not watched"
_LATE = "point 5: a delay that TIMESYNC tells is not named as the reason"

WAITING = {
    **{
        f"{kind}: {name}": _SELDOM
        for kind in ("px4", "ardupilot")
        for name in (
            "attitude lowered to 5 Hz for good",
            "attitude lowered to 12 Hz for good",
            "attitude lowered to 25 Hz for good",
            "attitude lowered to 5 Hz by a station, granted anew when asked for",
            "gaps of 120 ms in the attitude again and again",
        )
    },
    "px4: telemetry 400 ms late from the start, TIMESYNC prompt": _LATE,
    "ardupilot: telemetry 400 ms late from the start, TIMESYNC prompt": _LATE,
}
