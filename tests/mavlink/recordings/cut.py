"""Makes the `*-story.tlog` files here from whole recordings of real autopilots.

    python -m tests.mavlink.recordings.cut FOLDER

Kept are all heartbeats of the vehicle, all commands, parameters, texts and home positions with
their answers, every twentieth setpoint, and for two fifths of a second everything, so that the
rates at which messages came are still in it.
"""

import sys
from pathlib import Path

from pymavlink.dialects.v20 import ardupilotmega as dialect

from tests.mavlink.replay import VEHICLE, number, records, source

WHOLE_FROM = {  # s since the beginning of the log
    "px4-idle": 5.0,
    "px4-offboard-entry": 38.0,
    "px4-flight-companion": 30.0,
    "px4-flight-gcs": 30.0,
    "ardupilot-idle": 170.0,
    "ardupilot-flight": 60.0,
}
WHOLE_S = 0.4
EVERY = 20
STORY = {
    dialect.MAVLINK_MSG_ID_HEARTBEAT,
    dialect.MAVLINK_MSG_ID_COMMAND_LONG,
    dialect.MAVLINK_MSG_ID_COMMAND_ACK,
    dialect.MAVLINK_MSG_ID_PARAM_REQUEST_READ,
    dialect.MAVLINK_MSG_ID_PARAM_VALUE,
    dialect.MAVLINK_MSG_ID_PARAM_ERROR,
    dialect.MAVLINK_MSG_ID_STATUSTEXT,
    dialect.MAVLINK_MSG_ID_HOME_POSITION,
}


def cut(log, whole_from):
    """The records that are kept, as they stood in the log."""
    began, setpoints, kept = None, 0, bytearray()
    for stamp, frame in records(log):
        began = stamp if began is None else began
        keep = 0.0 <= stamp - began - whole_from < WHOLE_S
        if number(frame) == dialect.MAVLINK_MSG_ID_SET_ATTITUDE_TARGET:
            setpoints += 1
            keep |= setpoints % EVERY == 0
        elif number(frame) in STORY:
            keep |= source(frame) == VEHICLE or number(frame) != dialect.MAVLINK_MSG_ID_HEARTBEAT
        if keep:
            kept += round(stamp * 1e6).to_bytes(8, "big") + frame
    return bytes(kept)


if __name__ == "__main__":
    for name, whole_from in WHOLE_FROM.items():
        story = cut(Path(sys.argv[1]) / f"{name}.tlog", whole_from)
        (Path(__file__).parent / f"{name}-story.tlog").write_bytes(story)
