"""All that the monitors judge, as it was at one time. SI; world NED, body FRD."""

from math import inf
from typing import NamedTuple

from companion.attitude import Quaternion
from companion.control.loop_record import Unanswered
from companion.guidance.fence import Place
from companion.guidance.reference import Vector
from companion.vehicle.records import Battery, Estimator, Gps


class Autopilot(NamedTuple):
    """What the autopilot says of itself; None where it said nothing."""

    armed: bool | None = True
    landed: bool = False
    failsafe: bool = False
    battery: Battery | None = None
    gps: Gps | None = None
    estimator: Estimator | None = None


class Motion(NamedTuple):
    """How the vehicle moves, in the frame without the estimate's jumps.

    Attributes:
        q: attitude, or None.
        body_rates: rad/s.
        offset: position from where control began, m, or None.
        velocity: m/s.
        height: above home, m, or None; as the autopilot tells it, jumps included.
        off_course: distance from the reference, m; None where none is followed.
        thrust: as it was last sent, 0..1, or None.
        origin: where control began, or None where that is not known.
    """

    q: Quaternion | None = None
    body_rates: Vector = (0.0, 0.0, 0.0)
    offset: Vector | None = None
    velocity: Vector = (0.0, 0.0, 0.0)
    height: float | None = None
    off_course: float | None = None
    thrust: float | None = None
    origin: Place | None = None


class Control(NamedTuple):
    """When each stage of a sample's way last ran, s on our clock, and what stops it.

    Attributes:
        answered: a setpoint left.
        sampled: an attitude came.
        reason: why the newest attitude was not answered, or None.
        commanded: guidance made a command.
        placed: a position came, newer than those before.
        heard: anything at all came from the vehicle.
        position_fresh: the newest position is one to fly by.
        clock_change: how the vehicle's clock has jumped or restarted since control began, in
            words, or None.
        stood_still: for how long our own timer did not run since a setpoint left, s.
    """

    answered: float = inf
    sampled: float = inf
    reason: Unanswered | None = None
    commanded: float = inf
    placed: float = inf
    heard: float = inf
    position_fresh: bool = True
    clock_change: str | None = None
    stood_still: float = 0.0


class Health(NamedTuple):
    """Of the link and of this computer, over the last second or two; None where not known.

    Attributes:
        lost: share of the vehicle's frames that did not come.
        round_trip: of TIMESYNC, s.
        missed: share of answers that came after their deadline.
        starved: share of the time by which our own timer was late.
        answer_rate: setpoints a second, Hz, bursts counted as what they are (`HeldRates`).
        gaps: how many gaps in the answers there were within the last few seconds.
        position_rate: positions a second, Hz.
    """

    lost: float | None = None
    round_trip: float | None = None
    missed: float | None = None
    starved: float | None = None
    answer_rate: float | None = None
    gaps: int = 0
    position_rate: float | None = None


class Resets(NamedTuple):
    """Of the estimator, since control began.

    Attributes:
        recent: how many within the last while.
        shift: how far the position jumped in sum, m.
        turn: how far the heading jumped in sum, rad.
        tilt: largest jump of the thrust axis, rad.
    """

    recent: int = 0
    shift: float = 0.0
    turn: float = 0.0
    tilt: float = 0.0


class Snapshot(NamedTuple):
    """One look at everything; `now` in s on our clock.

    Attributes:
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
