"""Flies the mock through what a client did in a recording, and takes down what came when."""

import json
from collections import defaultdict
from pathlib import Path
from typing import Any

from mock_rig import Rig
from pymavlink.dialects.v20 import ardupilotmega, development

from sitl_mock.link.framing import Framer

NAMES = {
    number: message.msgname
    for dialect in (development, ardupilotmega)
    for number, message in dialect.mavlink_map.items()
}
RECORDINGS = Path(__file__).parent / "recordings"


def digest(name: str) -> dict[str, Any]:
    """Return the digest of a recording; `recordings/make_digest.py` says what is in it."""
    return json.loads((RECORDINGS / f"{name}.json").read_text())


class Script:
    """One recording's client, before a mock in vehicle time.

    Args:
        recording: the digest.
        rig: the mock, just begun.
        hover: the thrust of its setpoints; their rates are zero.
        shift: the mock's time less the recording's, s.
        pauses: (from, to): what passes there in the recording takes no time here.
    """

    def __init__(
        self,
        recording: dict[str, Any],
        rig: Rig,
        *,
        hover: float,
        shift: float = 0.0,
        pauses: tuple[tuple[float, float], ...] = (),
    ) -> None:
        self.recording = recording
        self.rig = rig
        self._hover = hover
        self._shift = shift
        self._pauses = pauses
        self.came: dict[str, list[float]] = defaultdict(list)
        system, component, self._type = recording["client"]
        rig.framer = Framer(system, component)
        rig._take = self._take

    def here(self, time: float) -> float:
        """Return the mock's time of a recorded one."""
        skipped = sum(max(0.0, min(time, to) - start) for start, to in self._pauses)
        return time - skipped + self._shift

    def run(self) -> None:
        """Do what the client did, to the end of the recording."""
        recording, rig = self.recording, self.rig
        todo = [(self.here(at), kind, values) for at, kind, values in recording["asked"]]
        first, last = map(self.here, recording["heartbeats"])
        setpoints = [
            (self.here(start), self.here(stop), hz) for start, stop, hz in recording["setpoints"]
        ]
        end, beat, sent = self.here(recording["to_s"]), first, -1.0
        while rig.time < end:
            now = rig.time
            if beat <= now <= last:
                rig.say(development.MAVLink_heartbeat_message(self._type, 8, 0, 0, 4, 3))
                beat += 1.0
            while todo and todo[0][0] <= now:
                self._ask(*todo.pop(0)[1:])
            for start, stop, hz in setpoints:
                if start <= now <= stop and now - sent >= 1.0 / hz - 1e-6:
                    rig.rates(thrust=self._hover)
                    sent = now
            rig.run(rig.simulation.next_us / 1e6 - now)

    def _ask(self, kind: str, values: dict[str, Any]) -> None:
        message_type = getattr(ardupilotmega, f"MAVLink_{kind.lower()}_message")
        filled = {name: values.get(name, 0) for name in message_type.fieldnames}
        if "param_id" in filled:
            filled["param_id"] = str(filled["param_id"] or "").encode()
        self.rig.say(message_type(**filled))

    def _take(self) -> None:
        frames = self.rig.simulation.companion.take_frames()
        if self.rig.time < self.here(self.recording["from_s"]):
            return  # nobody recorded it
        for frame in frames:
            number = int.from_bytes(frame[7:10], "little")
            self.came[NAMES.get(number, f"#{number}")].append(self.rig.time)
