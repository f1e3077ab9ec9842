"""The snapshot that all monitors judge. SI units; world NED, body FRD."""

from math import inf
from typing import NamedTuple

from companion.attitude import Quaternion
from companion.control.loop_record import Unanswered
from companion.guidance.fence import Place
from companion.guidance.reference import Horizontal, Vector
from companion.vehicle.records import Battery, Estimator, Gps
from companion.vehicle.timesync import Uplink

UNHEARD_S = 0.3
"""Time without a frame, s, after which the vehicle counts as not heard. From then on a takeover
could go unnoticed."""


class Autopilot(NamedTuple):
    """The autopilot's status; None: not received."""

    armed: bool | None = True
    landed: bool = False
    failsafe: bool = False
    battery: Battery | None = None
    gps: Gps | None = None
    estimator: Estimator | None = None


class Motion(NamedTuple):
    """Motion of the vehicle, in the frame without estimator resets.

    Attributes:
        q: attitude (w, x, y, z) as the autopilot reports it, with estimator resets, or None.
        body_rates: measured rates about the body axes, rad/s.
        offset: position relative to the fence's centre, which is usually where control began, m, or
            None.
        velocity: m/s.
        height: height above home, m, or None; in the autopilot's frame, with estimator resets.
        tracking_error: distance from the reference, m; None without a reference.
        thrust: thrust last sent, 0..1; None while idle on the ground and without a command.
        origin: latitude and longitude of the fence's centre, or None if they are unknown.
        acceleration: estimated horizontal acceleration, m/s², NED.
    """

    q: Quaternion | None = None
    body_rates: Vector = (0.0, 0.0, 0.0)
    offset: Vector | None = None
    velocity: Vector = (0.0, 0.0, 0.0)
    height: float | None = None
    tracking_error: float | None = None
    thrust: float | None = None
    origin: Place | None = None
    acceleration: Horizontal = (0.0, 0.0)


class Control(NamedTuple):
    """When data last arrived, which sample was last answered, and why the newest one is not.

    Times are in s of event-loop time. A sample is answered when a setpoint is sent for it.

    Attributes:
        last_answer: arrival of the last answered sample.
        last_sample: arrival of the last usable attitude sample.
        attitude_not_finite: whether the newest attitude was refused for a NaN or infinity.
        reason: why the newest sample is unanswered, or None.
        last_position: arrival of the last position that was newer than all before.
        position_not_finite: whether the newest position was refused for a NaN or infinity.
        last_heard: when the arrival of a frame of any kind from the vehicle was last noticed.
        position_fresh: whether the newest position is fresh.
        clock_change: latest jump, stop or restart of the vehicle's clock since control began, in
            words, or None.
        stalled: time for which this program did not run since the last answer, s.
    """

    last_answer: float = inf
    last_sample: float = inf
    attitude_not_finite: bool = False
    reason: Unanswered | None = None
    last_position: float = inf
    position_not_finite: bool = False
    last_heard: float = inf
    position_fresh: bool = True
    clock_change: str | None = None
    stalled: float = 0.0


class Health(NamedTuple):
    """Link and computer over the last second; None: unknown.

    Attributes:
        lost: share of the vehicle's frames that were lost.
        round_trip: round trip of TIMESYNC, s.
        missed: share of setpoints that missed their deadline; None in lockstep.
        starved: share of the time by which the program's timer was late.
        answer_rate: effective rate of setpoints, Hz (`IntervalSums`).
        gaps: number of gaps in the setpoints within the last 5 s.
        position_rate: rate of positions, Hz.
        foreign: number of reports of the last 5 s in which the autopilot obeyed another program's
            setpoint (`SetpointEcho`).
        uplink: the way to the vehicle, over the last moments.
    """

    lost: float | None = None
    round_trip: float | None = None
    missed: float | None = None
    starved: float | None = None
    answer_rate: float | None = None
    gaps: int = 0
    position_rate: float | None = None
    uplink: Uplink = Uplink()
    foreign: int = 0


class Resets(NamedTuple):
    """Estimator resets since control began.

    Attributes:
        recent: number of resets within the last 30 s.
        shift: length of the vector sum of the position jumps, m.
        heading: sum of the heading jumps, with their signs, rad.
        tilt: largest jump of the thrust axis, rad.
    """

    recent: int = 0
    shift: float = 0.0
    heading: float = 0.0
    tilt: float = 0.0


class Snapshot(NamedTuple):
    """The state of vehicle, link and computer at one time.

    Attributes:
        now: time of the snapshot, s of event-loop time.
        had_gps: whether GPS has had a 3D fix.
        good_flags: ESTIMATOR_STATUS flags that were set when control began.
    """

    now: float
    autopilot: Autopilot = Autopilot()
    motion: Motion = Motion()
    control: Control = Control()
    health: Health = Health()
    resets: Resets = Resets()
    had_gps: bool = False
    good_flags: int = 0
