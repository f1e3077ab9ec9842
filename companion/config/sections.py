"""The sections of the configuration, one a room: units in the key names, what each key means.

Degrees and milliseconds live only here, for people; `companion.flight.assembly` turns them into SI.
Every field's description is also what an editor shows, through the JSON Schema.
"""

from pathlib import Path
from typing import Annotated, Literal, NamedTuple

from pydantic import Field, StrictBool, model_validator

from companion.attitude import PLANNER_NAMES
from companion.drag import Drag
from companion.files.yaml_file import PathKey, Section

Share = Annotated[float, Field(ge=0.0, le=1.0)]
Seconds = Annotated[float, Field(gt=0.0, le=3600.0)]


class LinkConfig(Section):
    """How to reach the autopilot."""

    backend: Literal["direct", "mavsdk"] = "direct"
    """direct, or mavsdk: MAVSDK holds the connection, and our frames go by it (extra `mavsdk`)."""
    endpoint: Annotated[str, Field(max_length=300)] = "udpin://0.0.0.0:14540"
    """udpin://, udpout://, tcp://, tcpin:// with host:port, or serial://DEVICE:BAUD; udpin and
    tcpin also take ?peer=HOST[:PORT], to hear no other."""
    target_system: Annotated[int, Field(ge=1, le=255)] = 1
    """System id of the autopilot; every other system is ignored."""
    target_component: Annotated[int, Field(ge=1, le=255)] = 1
    """Component id of the autopilot."""
    source_system: Annotated[int, Field(ge=1, le=255)] = 1
    """Our own system id; a companion computer shares its vehicle's."""
    source_component: Annotated[int, Field(ge=1, le=255)] = 191
    """Our own component id; 191 is MAV_COMP_ID_ONBOARD_COMPUTER."""
    signing_key_file: PathKey | None = None
    """File whose first line is the passphrase: sign what we send, refuse what is not signed."""
    lockstep: StrictBool = False
    """Run on the bundled vehicle's clock, step by step. Never with a real vehicle."""
    attitude_rate_hz: Annotated[float, Field(ge=20.0, le=1000.0)] = 250.0
    """Asked of the autopilot for ATTITUDE_QUATERNION; the loop runs at what really arrives."""
    min_attitude_rate_hz: Annotated[float, Field(ge=10.0, le=1000.0)] = 50.0
    """Refuse to fly if less than this arrives."""
    position_rate_hz: Annotated[float, Field(ge=5.0, le=200.0)] = 50.0
    """Asked for LOCAL_POSITION_NED."""
    min_position_rate_hz: Annotated[float, Field(ge=1.0, le=200.0)] = 10.0
    """Refuse to fly if less than this arrives."""

    @model_validator(mode="after")
    def _consistent(self) -> "LinkConfig":
        if self.min_attitude_rate_hz > self.attitude_rate_hz:
            raise ValueError("min_attitude_rate_hz must not exceed attitude_rate_hz")
        if self.min_position_rate_hz > self.position_rate_hz:
            raise ValueError("min_position_rate_hz must not exceed position_rate_hz")
        if self.backend == "mavsdk" and (self.lockstep or self.signing_key_file is not None):
            raise ValueError("backend: mavsdk can neither fly in lockstep nor sign; use direct")
        ours, theirs = self.source_component, self.target_component
        if (self.source_system, ours) == (self.target_system, theirs):
            raise ValueError("source_system and source_component are the autopilot's own")
        return self


AUTO = "auto"


class PlannerConfig(Section):
    """The attitude law."""

    name: Annotated[
        str, Field(max_length=50, json_schema_extra={"enum": [AUTO, *PLANNER_NAMES]})
    ] = AUTO
    """auto: model-following where `vehicle` tells how the rate loop answers, else first-order.
    first-order: Algorithm 1 of Xu & Pei (Sensors 2026, 26(9), 2727). exact: the same without its
    error of discretisation. model-following: stays linear behind the vehicle's own rate loop,
    needs `vehicle`. quaternion, so3, euler: what the paper compares with."""
    gain_per_s: Annotated[float, Field(gt=0.0, le=20.0)] = 5.0
    """p: acceleration approaches its target with the time constant 1/p."""
    yaw_gain_per_s: Annotated[float, Field(ge=0.0, le=20.0)] = 2.0
    """Heading approaches its target with the time constant 1/yaw_gain; quaternion, so3 and euler
    use gain_per_s for it."""

    @model_validator(mode="after")
    def _known_name(self) -> "PlannerConfig":
        if self.name not in (AUTO, *PLANNER_NAMES):
            known = ", ".join((AUTO, *PLANNER_NAMES))
            raise ValueError(f"unknown planner {self.name!r}; known: {known}")
        return self


Milliseconds = Annotated[float, Field(ge=0.0, le=1000.0)]
Damping = Annotated[float, Field(ge=0.3, le=10.0)]
AccelerationLimit = Annotated[float, Field(gt=0.0, le=100_000.0)]


class AxisKeys(NamedTuple):
    """How one axis of the rate loop answers; None: not known, or no limit, or of first order."""

    lag_ms: float | None
    dead_time_ms: float | None
    acceleration_limit_deg_s2: float | None
    damping: float | None

    def but(self, *keys: float | None) -> "AxisKeys":
        """These, but for the `keys` that are not None; an axis with a lag has its own damping."""
        mine = self if keys[0] is None else self._replace(damping=None)
        return AxisKeys(*(a if b is None else b for a, b in zip(mine, keys, strict=True)))


class VehicleConfig(Section):
    """How the vehicle's own rate loop answers; `model-following` plans with it."""

    lag_ms: Milliseconds | None = None
    """Time constant of the roll rate after its dead time; of a second order, 2·damping/frequency:
    in either, how late the rate is on average."""
    dead_time_ms: Milliseconds | None = None
    """From an attitude sample to the first effect of its answer on the roll rate."""
    acceleration_limit_deg_s2: AccelerationLimit | None = None
    """The autopilot changes the roll rate it aims at no faster (ArduPilot); null: it does not limit
    this (PX4)."""
    damping: Damping | None = None
    """Damping ratio of the roll rate where its response is of second order; null: first order."""
    pitch_lag_ms: Milliseconds | None = None
    """The same time constant for pitch; null: that of roll."""
    pitch_dead_time_ms: Milliseconds | None = None
    """The same dead time for pitch; null: that of roll."""
    pitch_acceleration_limit_deg_s2: AccelerationLimit | None = None
    """The same limit for pitch; null: that of roll."""
    pitch_damping: Damping | None = None
    """The same damping ratio for pitch; null: first order, or that of roll with roll's lag."""
    yaw_lag_ms: Milliseconds | None = None
    """The same time constant for yaw; null: that of roll."""
    yaw_dead_time_ms: Milliseconds | None = None
    """The same dead time for yaw; null: that of roll."""
    yaw_acceleration_limit_deg_s2: AccelerationLimit | None = None
    """The same limit for yaw; null: that of roll."""
    yaw_frame_lead_ms: Milliseconds | None = None
    """By how long the axes along which the autopilot takes our rates turn before the body does, in
    yaw more than in tilt: ArduPilot's attitude target. Used while ATTITUDE_TARGET does not tell
    where they stand. null: as the times above say where acceleration is limited (ArduPilot), else
    0: they are the body's own (PX4)."""

    @property
    def known(self) -> bool:
        """Whether `model-following` can plan with it."""
        return self.lag_ms is not None and self.dead_time_ms is not None

    @property
    def axes(self) -> "dict[str, AxisKeys]":
        """What is known of roll, pitch and yaw, by name; what is null of the last two is roll's."""
        roll = AxisKeys(
            self.lag_ms, self.dead_time_ms, self.acceleration_limit_deg_s2, self.damping
        )
        pitch = (
            self.pitch_lag_ms,
            self.pitch_dead_time_ms,
            self.pitch_acceleration_limit_deg_s2,
            self.pitch_damping,
        )
        yaw = self.yaw_lag_ms, self.yaw_dead_time_ms, self.yaw_acceleration_limit_deg_s2, None
        first_order = roll._replace(damping=None)
        return {"roll": roll, "pitch": roll.but(*pitch), "yaw": first_order.but(*yaw)}


class LimitsConfig(Section):
    """What we never ask of the vehicle, and where it may fly."""

    max_tilt_deg: Annotated[float, Field(ge=1.0, le=60.0)] = 35.0
    """Largest tilt of a target; longer targets are shortened along their direction."""
    max_tilt_rate_deg_s: Annotated[float, Field(ge=1.0, le=1000.0)] = 90.0
    """Largest roll-pitch rate, as the length of the two."""
    max_yaw_rate_deg_s: Annotated[float, Field(ge=1.0, le=1000.0)] = 60.0
    """Largest yaw rate."""
    rate_limit: Literal["tight", "paper"] = "tight"
    """tight: limit only where the rate would be exceeded. paper: equation 33, slower."""
    recovery_angle_deg: Annotated[float, Field(gt=0.0, le=80.0)] = 75.0
    """Beyond this tilt the thrust axis is first brought up, the shortest way (not by quaternion,
    so3 and euler)."""
    min_thrust: Share = 0.1
    """Smallest normalised thrust sent in flight."""
    max_thrust: Share = 0.9
    """Largest normalised thrust sent."""
    max_climb_m_s: Annotated[float, Field(ge=0.1, le=20.0)] = 2.0
    """Largest upward speed that height hold asks for."""
    max_descent_m_s: Annotated[float, Field(ge=0.1, le=10.0)] = 1.0
    """Largest downward speed that height hold asks for."""
    fence_radius_m: Annotated[float, Field(ge=0.1, le=2000.0)] = 50.0
    """Farthest from where control began; beyond it we hand back and land."""
    fence_ceiling_m: Annotated[float, Field(ge=0.1, le=1000.0)] = 30.0
    """Highest above where control began."""
    fence_floor_m: Annotated[float, Field(gt=0.0, le=100.0)] = 1.0
    """Lowest above home; below it we hand back and land."""
    min_battery_percent: Annotated[float, Field(ge=0.0, le=100.0)] = 20.0
    """Below this: no arming, and in flight hand back and land."""

    @model_validator(mode="after")
    def _consistent(self) -> "LimitsConfig":
        if self.max_tilt_deg > self.recovery_angle_deg:
            raise ValueError("max_tilt_deg must not exceed recovery_angle_deg")
        if self.min_thrust >= self.max_thrust:
            raise ValueError("min_thrust must be below max_thrust")
        return self


class DeadmanConfig(Section):
    """When silence ends control. A setpoint leaves only in answer to fresh data."""

    telemetry_stale_ms: Annotated[float, Field(ge=10.0, le=500.0)] = 100.0
    """Attitude older than this is not answered, and counts as silence. Where TIMESYNC is not
    answered, older than the quickest sample by this."""
    target_stale_ms: Annotated[float, Field(ge=20.0, le=500.0)] = 150.0
    """Guidance older than this is not answered."""
    position_stale_ms: Annotated[float, Field(ge=50.0, le=1000.0)] = 300.0
    """Position older than this, by its arrival or by its time stamp on the vehicle's clock, stops
    guidance, and so the setpoints."""
    silence_limit_ms: Annotated[float, Field(ge=50.0, le=1000.0)] = 500.0
    """Control that stood still this long is not taken up again: hand back. Keep it below the
    autopilot's own limit (PX4: COM_OF_LOSS_T, 1 s; ArduPilot: GUID_TIMEOUT, 3 s)."""
    deadline_ms: Annotated[float, Field(gt=0.0, le=100.0)] = 4.0
    """An answer that leaves later than this after its sample reached this computer (over TCP and
    serial: after it was read) counts as a missed deadline."""

    @model_validator(mode="after")
    def _consistent(self) -> "DeadmanConfig":
        if self.silence_limit_ms < max(self.telemetry_stale_ms, self.target_stale_ms):
            raise ValueError("silence_limit_ms must be at least as long as the stale limits")
        return self


class GuidanceConfig(Section):
    """Linear guidance above the attitude law: a reference followed without lag."""

    kind: Literal["linear", "nmpc"] = "linear"
    """linear, or nmpc: nonlinear model predictive control follows trajectories, in a process of
    its own (extra `nmpc`); linear guidance flies the rest, and wherever its answer is missing."""
    rate_hz: Annotated[float, Field(ge=10.0, le=100.0)] = 50.0
    """How often guidance makes a new target."""
    position_weight_per_s4: Annotated[float, Field(ge=0.01, le=10000.0)] | None = None
    """Weight of the horizontal position error against the acceleration spent on it; a larger one
    makes a stiffer hold. The gains follow from it (LQR). null: 2/T⁴ where dead time and
    half the lag are 65 ms at most, 1/T⁴ from 80 ms on or where they are not known; T is the
    delay of the attitude by planner.gain_per_s, `vehicle` (0.12 s where it is not known) and
    half a period of guidance."""
    velocity_weight_per_s2: Annotated[float, Field(ge=0.0, le=10000.0)] | None = None
    """Weight of the horizontal velocity error; a larger one makes a calmer hold. null: 1/T²."""
    disturbance_bandwidth_rad_s: Annotated[float, Field(gt=0.0, le=30.0)] | None = None
    """How quickly wind is found, from how the vehicle moves against what its tilt gives.
    null: 1.5/T."""
    position_lateness_ms: Annotated[float, Field(ge=0.0, le=100.0)] = 0.0
    """By how much the autopilot's position is late where its GPS is later than its estimator
    believes; measured against another measurement of the position."""
    max_disturbance_m_s2: Annotated[float, Field(ge=0.0, le=20.0)] = 6.0
    """Largest acceleration by wind that is believed."""
    lead: bool = True
    """Lead the targets through the known inner response, so that the vehicle is not late."""
    height_gain_per_s: Annotated[float, Field(ge=0.0, le=20.0)] = 1.5
    """Vertical speed per metre of height error."""
    climb_gain_per_s: Annotated[float, Field(ge=0.0, le=20.0)] = 3.5
    """Vertical acceleration per m/s of vertical speed error."""
    drag_per_s: Annotated[float, Field(ge=0.0, le=10.0)] | None = None
    """Linear drag per mass, which is fed forward. null: not known; flight learns it, as it corrects
    a number, and the next flight of the vehicle begins with what was learned."""
    quadratic_drag_per_m: Annotated[float, Field(ge=0.0, le=1.0)] = 0.0
    """Quadratic drag per mass, where drag_per_s is a number: the vehicle is slowed down by
    (drag_per_s + quadratic_drag_per_m·speed)·speed."""

    @property
    def drag(self) -> Drag | None:
        """The drag as far as it is told."""
        told = self.drag_per_s
        return None if told is None else Drag(told, self.quadratic_drag_per_m)


class ThrustConfig(Section):
    """From specific thrust in m/s² to the 0..1 that MAVLink carries."""

    hover_thrust: Annotated[float, Field(gt=0.05, lt=0.95)] = 0.5
    """Normalised thrust at which the vehicle hovers (PX4: MPC_THR_HOVER, ArduPilot:
    MOT_THST_HOVER)."""
    correction_limit: Annotated[float, Field(ge=0.0, le=2.0)] = 0.8
    """By which share flight may correct hover_thrust at most: up to 1.8 times, down to 1/1.8."""
    correction_time_s: Annotated[float, Field(ge=0.2, le=60.0)] = 1.5
    """Time constant with which flight follows a slow change; what is wrong at first is put right at
    once."""
    curve_factor: Share = 0.0
    """f in thrust = f·u² + (1 − f)·u; 0 where the autopilot makes up for the curve itself, by an f
    of its own (PX4: THR_MDL_FAC, ArduPilot: MOT_THST_EXPO)."""
    battery_exponent: Annotated[float, Field(ge=0.0, le=3.0)] = 2.0
    """Thrust goes with the battery's voltage to this power; 0: the autopilot sees to it, or its
    voltage means nothing."""
    lag_ms: Milliseconds | None = None
    """Time constant of the rotors' thrust, which is then led; null: not known."""
    autopilot_compensates_tilt: StrictBool = False
    """Whether it divides thrust by cos(tilt) itself, so that we must not (ArduPilot:
    ATC_ANGLE_BOOST; PX4 does not)."""


class FlightConfig(Section):
    """What to fly, and how long each phase may take."""

    takeoff_height_m: Annotated[float, Field(ge=1.5, le=100.0)] = 5.0
    """Height above home to which the autopilot takes off."""
    maneuvers: Annotated[
        tuple[Literal["hover", "steps", "circle", "corners", "identify", "trajectory"], ...],
        Field(min_length=1, max_length=20),
    ] = (
        "hover",
        "steps",
        "circle",
    )
    """Flown in this order."""
    trajectory: PathKey | None = None
    """File of what the maneuver `trajectory` follows: configs/trajectories/figure8.yaml, say."""
    slow_down: bool = False
    """Slow a trajectory down that the limits do not allow, instead of refusing it."""
    arm: StrictBool = False
    """Arm by ourselves. Otherwise the pilot arms, and we wait for it; `fly --arm` says yes too."""
    accept: Annotated[tuple[Annotated[str, Field(max_length=100)], ...], Field(max_length=100)] = ()
    """Unsafe findings of `companion doctor` with which it is flown all the same, by their names,
    such as COM_OF_LOSS_T; each is told in the flight's events."""
    connect_timeout_s: Seconds = 30.0
    """Wait this long for a heartbeat."""
    ready_timeout_s: Seconds = 60.0
    """Wait this long for the autopilot's estimator and pre-arm checks."""
    arming_timeout_s: Seconds = 60.0
    """Wait this long for the vehicle to be armed."""
    takeoff_timeout_s: Seconds = 40.0
    """Wait this long to reach takeoff_height_m."""
    landing_timeout_s: Seconds = 90.0
    """Wait this long for the autopilot to report that it has landed."""


class RealtimeConfig(Section):
    """What is asked of the operating system: each is granted or not, and the flight says which."""

    scheduler: Literal["other", "fifo"] = "other"
    """other: as every program. fifo: before all of them (SCHED_FIFO), while it has work."""
    priority: Annotated[int, Field(ge=1, le=90)] = 50
    """Of fifo; the kernel's own threads for interrupts have 50, and above 90 are watchdogs."""
    cpu_affinity: Annotated[
        tuple[Annotated[int, Field(ge=0, le=1023)], ...], Field(max_length=1024)
    ] = ()
    """Run on these processors only, numbered from 0; none named: on any."""
    lock_memory: StrictBool = False
    """Keep all of the program's memory in RAM: no wait for the disk in the middle of a step."""
    freeze_gc: StrictBool = False
    """No garbage collection in flight; what it would have found is freed afterwards."""
    required: StrictBool = False
    """Refuse to fly unless all that is asked for is granted."""


class RecordingConfig(Section):
    """What is written down."""

    directory: PathKey = Path("flights")
    """Each flight makes a folder of its own in here."""
