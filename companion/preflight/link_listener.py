"""Listens to the link for a while: sample times, other nodes, estimator resets."""

from collections.abc import Callable
from itertools import pairwise
from math import isfinite
from statistics import median

from companion.attitude.representation import is_unit
from companion.mavlink.framing import Frame
from companion.mavlink.messages import Message, decode, dialect
from companion.preflight.evidence import OtherNodes, SampleTimes
from companion.vehicle.autopilot import Role
from companion.vehicle.interval_sums import IntervalSums
from companion.vehicle.link import Link
from companion.vehicle.registry import AUTOPILOTS_BY_NUMBER

_HEARTBEAT_ID = dialect.MAVLINK_MSG_ID_HEARTBEAT
_SETPOINT_IDS = frozenset(
    {
        dialect.MAVLINK_MSG_ID_SET_ATTITUDE_TARGET,
        dialect.MAVLINK_MSG_ID_SET_POSITION_TARGET_LOCAL_NED,
        dialect.MAVLINK_MSG_ID_SET_POSITION_TARGET_GLOBAL_INT,
    }
)
_MAX_IDLE_TARGET = 0.05
"""Largest body rate (rad/s) and thrust in ATTITUDE_TARGET of a disarmed autopilot that receives no
setpoints in the mode in which it obeys them (recorded: 0.02 rad/s, 0).
"""
_MIN_SAMPLES = 10
"""Smallest number of samples to measure the rate of a clock."""


class LinkListener:
    """Collects what comes over the link while its `with` block runs.

    Args:
        link: link to listen on. The `with` block replaces the link's `on_foreign_frame`.
        clock: our clock, s.

    Attributes:
        other_nodes: the other nodes heard so far.
        reset_count: number of estimator resets, counted by ODOMETRY's `reset_counter`.
    """

    def __init__(self, link: Link, clock: Callable[[], float]) -> None:
        self._link, self._clock = link, clock
        # Arrival by our clock, and time stamp of the vehicle, s.
        self._sample_times: list[tuple[float, float]] = []
        self._sample_ages: list[float] = []
        self._clock_change_count = link.clock.change_count
        self._unusable_count = 0
        self.other_nodes = OtherNodes()
        self._newest_reset_counter: int | None = None
        self.reset_count = 0

    def __enter__(self) -> "LinkListener":
        self._previous_on_foreign = self._link.on_foreign_frame
        self._link.on_foreign_frame = self._on_foreign_frame
        self._unsubscribe = [
            self._link.subscribe("ATTITUDE_QUATERNION", self._on_attitude),
            self._link.subscribe("ATTITUDE_TARGET", self._on_attitude_target),
            self._link.subscribe("ODOMETRY", self._on_odometry),
        ]
        return self

    def __exit__(self, *_: object) -> None:
        self._link.on_foreign_frame = self._previous_on_foreign
        for unsubscribe in self._unsubscribe:
            unsubscribe()

    @property
    def samples(self) -> SampleTimes:
        """Times and counts of the attitude samples received so far."""
        sample_pairs = list(pairwise(self._sample_times))
        if not sample_pairs:
            return SampleTimes(len(self._sample_times), unusable_count=self._unusable_count)
        (first_arrival, first_stamp), (last_arrival, last_stamp) = (
            self._sample_times[0],
            self._sample_times[-1],
        )
        enough_samples = len(self._sample_times) >= _MIN_SAMPLES and last_arrival > first_arrival
        arrival_intervals, clock = IntervalSums(), self._link.clock
        for earlier, later in sample_pairs:
            arrival_intervals.add(later[0] - earlier[0])
        return SampleTimes(
            sample_count=len(self._sample_times),
            longest_pause=max(later[0] - earlier[0] for earlier, later in sample_pairs),
            not_newer_count=sum(later[1] <= earlier[1] for earlier, later in sample_pairs),
            unusable_count=self._unusable_count,
            clock_rate=(last_stamp - first_stamp) / (last_arrival - first_arrival)
            if enough_samples
            else None,
            age=median(self._sample_ages) if self._sample_ages and clock.age_known else None,
            clock_change=clock.last_change
            if clock.change_count != self._clock_change_count
            else "",
            rate=arrival_intervals.rate_since(IntervalSums()) if enough_samples else None,
        )

    def _on_foreign_frame(self, frame: Frame) -> None:
        source = frame.system, frame.component
        self.other_nodes.sources.add(source)
        if frame.message_id in _SETPOINT_IDS:
            self.other_nodes.setpoint_senders.add(source)
        if frame.message_id != _HEARTBEAT_ID:
            return
        heartbeat = decode(frame.message_id, frame.payload)
        if heartbeat.type == dialect.MAV_TYPE_ONBOARD_CONTROLLER:
            self.other_nodes.companions.add(source)
        elif heartbeat.autopilot in AUTOPILOTS_BY_NUMBER:
            self.other_nodes.autopilots.add(source)

    def _on_attitude(self, message: Message) -> None:
        now, clock = self._clock(), self._link.clock
        self._sample_times.append((now, message.time_boot_ms / 1000.0))
        age = clock.age(clock.vehicle_time(message.time_boot_ms), now)
        if age is not None:
            self._sample_ages.append(age)
        rates = message.rollspeed, message.pitchspeed, message.yawspeed
        is_unit_quaternion = is_unit((message.q1, message.q2, message.q3, message.q4))
        self._unusable_count += not (is_unit_quaternion and all(map(isfinite, rates)))

    def _on_attitude_target(self, message: Message) -> None:
        rates = message.body_roll_rate, message.body_pitch_rate, message.body_yaw_rate
        is_active = any(abs(value) > _MAX_IDLE_TARGET for value in (*rates, message.thrust))
        state = self._link.state
        # In its other modes the autopilot shows targets of its own: those of a PX4 that stands on a
        # slope of 1 degree are 0.1 rad/s (measured).
        obeys_setpoints = state.mode is not None and (
            Role.OFFBOARD in self._link.autopilot.roles(state.mode)
        )
        self.other_nodes.has_foreign_attitude_target |= (
            is_active and obeys_setpoints and state.armed is False
        )

    def _on_odometry(self, message: Message) -> None:
        counter_before = self._newest_reset_counter
        self._newest_reset_counter = message.reset_counter
        if counter_before is not None:
            self.reset_count += (message.reset_counter - counter_before) & 0xFF
