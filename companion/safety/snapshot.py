"""The snapshot that all monitors judge. SI units; world NED, body FRD."""

from math import inf
from typing import NamedTuple

from companion.attitude import Quaternion
from companion.control.loop_record import UnansweredReason
from companion.guidance.fence import LatLon
from companion.guidance.reference import NorthEast, Vector
from companion.vehicle.records import Battery, EstimatorStatus, Gps
from companion.vehicle.timesync import Uplink

HEARD_TIMEOUT_S = 0.3
"""Time without a frame, s, after which the vehicle counts as not heard. From then on a takeover
could go unnoticed."""


class AutopilotStatus(NamedTuple):
    """The autopilot's status; None: not received."""

    armed: bool | None = True
    landed: bool = False
    failsafe: bool = False
    battery: Battery | None = None
    gps: Gps | None = None
    estimator: EstimatorStatus | None = None


class Motion(NamedTuple):
    """Motion of the vehicle, in a frame that stays continuous when the estimator is reset."""

    q: Quaternion | None = None
    """Attitude (w, x, y, z) as the autopilot reports it, with estimator resets, or None."""
    body_rates: Vector = (0.0, 0.0, 0.0)
    """Measured rates about the body axes, rad/s."""
    offset: Vector | None = None
    """Position relative to the fence's centre (usually where control began), m NED, or None."""
    velocity: Vector = (0.0, 0.0, 0.0)
    """Velocity, m/s NED."""
    height: float | None = None
    """Height above home, m, or None; in the autopilot's frame, with estimator resets."""
    tracking_error: float | None = None
    """Distance from the reference, m; None without a reference."""
    thrust: float | None = None
    """Thrust last sent, 0..1; None while idle on the ground and without a command."""
    origin: LatLon | None = None
    """Latitude and longitude of the fence's centre, or None if they are unknown."""
    acceleration: NorthEast = (0.0, 0.0)
    """Estimated horizontal acceleration, m/s², NED."""
    wind: NorthEast = (0.0, 0.0)
    """Estimated acceleration that the wind gives a vehicle at rest, m/s², NED."""
    moves_to_hold: bool = False
    """Whether guidance still brakes or moves to the position that it will hold."""


class Control(NamedTuple):
    """Times of the last data and of the last answer, and why the newest sample is unanswered.

    Times are in s of event-loop time; inf: not known, which is no breach. A sample is answered when
    a setpoint is sent for it.
    """

    last_answered_arrival: float = inf
    """Arrival of the last answered sample."""
    last_sample_arrival: float = inf
    """Arrival of the last usable attitude sample."""
    attitude_not_finite: bool = False
    """Whether the newest attitude was refused for a NaN or infinity."""
    reason: UnansweredReason | None = None
    """Why the newest sample is unanswered, or None."""
    last_position_arrival: float = inf
    """Arrival of the last position that was newer than all before."""
    position_not_finite: bool = False
    """Whether the newest position was refused for a NaN or infinity."""
    command_not_finite: bool = False
    """Whether the newest command of guidance was refused for a NaN or infinity."""
    last_frame_noticed: float = inf
    """When the arrival of a frame of any kind from the vehicle was last noticed."""
    position_fresh: bool = True
    """Whether the newest position is not older than deadman.position_stale_ms."""
    clock_change: str | None = None
    """Latest jump, stop or restart of the vehicle's clock since control began, in words, or
    None."""
    stall_time: float = 0.0
    """Total time of the stalls of this program since `last_answered_arrival`, s."""


class Health(NamedTuple):
    """Link and computer over the last second; None: unknown."""

    lost_share: float | None = None
    """Share of the vehicle's frames that were lost."""
    round_trip: float | None = None
    """Round trip of TIMESYNC, s."""
    missed_share: float | None = None
    """Share of setpoints that missed their deadline; None in lockstep."""
    starved_share: float | None = None
    """Share of the time by which the program's timer was late."""
    answer_rate: float | None = None
    """Effective rate of setpoints, Hz (`IntervalSums`)."""
    gaps: int = 0
    """Number of gaps in the setpoints within the last 5 s."""
    position_rate: float | None = None
    """Rate of positions, Hz."""
    uplink: Uplink = Uplink()
    """Present delay and loss on the link to the vehicle."""
    foreign_reports: int = 0
    """Number of reports of the last 5 s in which the autopilot obeyed another program's setpoint
    (`SetpointEcho`)."""
    any_foreign_report: bool = False
    """Whether `foreign_reports` was above 0 at any time since control began."""
    frozen_telemetry: str | None = None
    """Which telemetry repeats itself although it must change (`FrozenTelemetry`), in words."""


class Resets(NamedTuple):
    """Estimator resets since control began."""

    recent_count: int = 0
    """Number of resets within the last 30 s."""
    position_shift: float = 0.0
    """Length of the vector sum of the position jumps, m."""
    heading_shift: float = 0.0
    """Sum of the heading jumps, with their signs, rad."""
    largest_tilt_jump: float = 0.0
    """Largest jump of the thrust axis, rad."""
    heading_drift: float = 0.0
    """Gradual change of the heading in 20 s that the body rates do not explain, rad."""
    height_contradiction: float = 0.0
    """Change of the height in 3 s that the vertical speed does not explain, m."""


class Snapshot(NamedTuple):
    """The state of vehicle, link and computer at one time."""

    now: float
    """Time of the snapshot, s of event-loop time."""
    autopilot: AutopilotStatus = AutopilotStatus()
    motion: Motion = Motion()
    control: Control = Control()
    health: Health = Health()
    resets: Resets = Resets()
    had_gps: bool = False
    """Whether GPS has had a 3D fix."""
    initial_estimator_flags: int = 0
    """ESTIMATOR_STATUS flags that were set when control began."""
