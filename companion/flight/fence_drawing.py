"""Draws the fence into the recording, for 3D viewers."""

from collections.abc import Iterator, Sequence
from math import inf

from companion.flight.context import FlightContext
from companion.guidance.fence import Corner, circle_corners, local_polygon
from companion.recording.mcap_file.scene import Color, Entity, Line, scene_message
from companion.recording.mcap_file.writer import McapWriter
from companion.recording.recorder import FlightRecorder
from companion.safety.table import fence_of

_DRAWING_PERIOD = 10.0
"""Period with which the fence is drawn again, s, because a viewer may join late."""
_CIRCLE_SIDES, _UPRIGHT_EDGES = 48, 12
"""Sides of the polygon that approximates a circle, and number of its upright edges."""
_FENCE_COLOR: Color = (0.9, 0.3, 0.3, 0.6)
Point = tuple[float, float, float]


class FenceDrawing:
    """Records the fence as a wireframe, every 10 s from the beginning of control on.

    Args:
        context: context of the flight.
        recorder: recorder of the flight.
    """

    def __init__(self, context: FlightContext, recorder: FlightRecorder) -> None:
        self._context, self._recorder = context, recorder
        self._fence = fence_of(context.config)
        self._due = -inf

    def record(self, now: float) -> None:
        """Record the fence if it is due at `now`, s on our clock."""
        snapshots, motion = self._context.snapshot_builder, self._context.guidance_loop.motion
        height, centre = self._context.link.state.height, snapshots.fence_centre
        origin = snapshots.fence_centre_ned
        if now < self._due or centre is None or origin is None or motion is None or height is None:
            return
        self._due = now + _DRAWING_PERIOD
        north, east, down = origin
        heights = self._fence.floor - height - motion.position_ned[2], self._fence.ceiling - down
        outlines = [circle_corners(self._fence.radius, _CIRCLE_SIDES)]
        if self._fence.places and centre.place is not None:
            outlines.append(local_polygon(self._fence.places, centre.place))
        elif self._fence.polygon:
            outlines.append(self._fence.polygon)
        points = [
            (east + corner[1], north + corner[0], up)
            for outline in outlines
            for corner, up in _edges(outline, heights)
        ]
        self._recorder.add(now, _write, points)


def _edges(
    outline: Sequence[Corner], heights: tuple[float, float]
) -> Iterator[tuple[Corner, float]]:
    """The two ends of each edge of a prism: floor, ceiling, and some upright edges."""
    edge_step = max(1, len(outline) // _UPRIGHT_EDGES)
    for number, (corner, next_corner) in enumerate(
        zip(outline, (*outline[1:], outline[0]), strict=True)
    ):
        for up in heights:
            yield corner, up
            yield next_corner, up
        if number % edge_step == 0:
            yield corner, heights[0]
            yield corner, heights[1]


def _write(writer: McapWriter, time_ns: int, points: list[Point]) -> None:
    fence = Entity("fence", "world", lines=(Line(points, _FENCE_COLOR, separate_pairs=True),))
    writer.message("/fence", time_ns, scene_message(time_ns, (fence,)))
