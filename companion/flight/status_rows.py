"""Records the thrust estimator, the program's resources, the link's counters, and the fence."""

import resource
from collections.abc import Callable, Iterator, Sequence
from math import inf, nan
from time import process_time

from companion.flight.context import FlightContext
from companion.guidance.fence import Corner, circle_corners, local_polygon
from companion.guidance.reference import Vector
from companion.recording.mcap_file.channels import RESOURCES, THRUST
from companion.recording.mcap_file.scene import Color, Entity, Line, scene_message
from companion.recording.mcap_file.writer import McapWriter
from companion.recording.recorder import FlightRecorder
from companion.safety.table import fence_of

_RESOURCES_PERIOD = 1.0
_KB_PER_MB = 1024.0
_DRAWING_PERIOD = 10.0
"""Period with which the fence is drawn again, s, because a viewer may join late."""
_CIRCLE_SIDES, _UPRIGHT_EDGES = 48, 12
"""Sides of the polygon that approximates a circle, and number of its upright edges."""
_FENCE_COLOR: Color = (0.9, 0.3, 0.3, 0.6)


class StatusRows:
    """Records thrust ten times a second, and resources and link once a second.

    Args:
        clock: returns event-loop time, s.
    """

    def __init__(
        self, context: FlightContext, recorder: FlightRecorder | None, clock: Callable[[], float]
    ) -> None:
        self._context, self._recorder = context, recorder
        self._fence = None if recorder is None else _FenceDrawing(context, recorder)
        self._next_resources_time = self._measured_at = clock()
        self._processor_s = process_time()

    def record(self, now: float) -> None:
        """Record what is due at `now`, s of event-loop time."""
        recorder = self._recorder
        if recorder is None or self._fence is None:
            return
        self._fence.record(now)
        recorder.row(now, THRUST, self._thrust_row(now))
        if now >= self._next_resources_time:
            self._next_resources_time = now + _RESOURCES_PERIOD
            recorder.row(now, RESOURCES, self._resources_row(now, recorder))

    def _thrust_row(self, now: float) -> tuple[float, ...]:
        context = self._context
        learning, battery = context.guidance_loop.learning, context.link.state.battery
        voltage = None if battery is None else battery.voltage_v
        remaining = None if battery is None else battery.remaining
        return (
            now,
            learning.hover_thrust.learned_hover,
            *learning.thrust_limits,
            context.loop.record.thrust,
            nan if voltage is None else voltage,
            nan if remaining is None else remaining,
        )

    def _resources_row(self, now: float, recorder: FlightRecorder) -> tuple[float, ...]:
        """The row of `RESOURCES`; in a test, the mock vehicle's processor time is included."""
        processor_s, earlier_processor_s = process_time(), self._processor_s
        elapsed, self._measured_at = now - self._measured_at, now
        self._processor_s = processor_s
        link, record = self._context.link, self._context.loop.record
        round_trip = link.timesync.round_trip_s
        return (
            now,
            (processor_s - earlier_processor_s) / elapsed if elapsed > 0.0 else nan,
            resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / _KB_PER_MB,
            recorder.waiting,
            recorder.dropped,
            link.stats.frames,
            link.stats.lost,
            link.stats.sent,
            nan if round_trip is None else 1e3 * round_trip,
            record.setpoints,
            record.missed_deadlines,
        )


class _FenceDrawing:
    """Records the fence as a wireframe, every 10 s from the beginning of control on."""

    def __init__(self, context: FlightContext, recorder: FlightRecorder) -> None:
        self._context, self._recorder = context, recorder
        self._fence = fence_of(context.config)
        self._next_drawing_time = -inf

    def record(self, now: float) -> None:
        """Record the fence if it is due at `now`, s of event-loop time."""
        snapshots, motion = self._context.snapshot_builder, self._context.guidance_loop.motion
        height, centre = self._context.link.state.height, snapshots.fence_centre
        origin = snapshots.fence_centre_ned
        if (
            now < self._next_drawing_time
            or centre is None
            or origin is None
            or motion is None
            or height is None
        ):
            return
        self._next_drawing_time = now + _DRAWING_PERIOD
        north, east, down = origin
        end_heights = (
            self._fence.floor - height - motion.position_ned[2],
            self._fence.ceiling - down,
        )
        outlines = [circle_corners(self._fence.radius, _CIRCLE_SIDES)]
        if self._fence.polygon_deg and centre.lat_lon is not None:
            outlines.append(local_polygon(self._fence.polygon_deg, centre.lat_lon))
        elif self._fence.polygon:
            outlines.append(self._fence.polygon)
        points = [
            (east + corner[1], north + corner[0], edge_height)
            for outline in outlines
            for corner, edge_height in _edges(outline, end_heights)
        ]
        self._recorder.add(now, _write_fence, points)


def _edges(
    outline: Sequence[Corner], end_heights: tuple[float, float]
) -> Iterator[tuple[Corner, float]]:
    """Both ends (corner, m; height, m) of each edge of a prism, with only some upright edges."""
    edge_step = max(1, len(outline) // _UPRIGHT_EDGES)
    for number, (corner, next_corner) in enumerate(
        zip(outline, (*outline[1:], outline[0]), strict=True)
    ):
        for edge_height in end_heights:
            yield corner, edge_height
            yield next_corner, edge_height
        if number % edge_step == 0:
            yield corner, end_heights[0]
            yield corner, end_heights[1]


def _write_fence(writer: McapWriter, time_ns: int, points: list[Vector]) -> None:
    fence = Entity("fence", "world", lines=(Line(points, _FENCE_COLOR, separate_pairs=True),))
    writer.message("/fence", time_ns, scene_message(time_ns, (fence,)))
