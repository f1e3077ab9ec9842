"""A frame whose north is rotated from the north of the autopilot's estimator."""

from typing import NamedTuple

from companion.attitude import Quaternion, Target
from companion.attitude.rotation import turned_about_vertical
from companion.guidance.reference import rotate


class HeadingFrame(NamedTuple):
    """Converts headings, attitudes and targets between the estimator's frame and this one."""

    offset: float = 0.0
    """Heading in the estimator's frame minus heading in this frame, rad."""

    def heading(self, estimated: float) -> float:
        """The heading in this frame, from the heading in the estimator's frame; rad."""
        return estimated - self.offset

    def estimated_heading(self, heading: float) -> float:
        """The heading in the estimator's frame, from the heading in this frame; rad."""
        return heading + self.offset

    def attitude(self, estimated: Quaternion) -> Quaternion:
        """The attitude in this frame, from the attitude in the estimator's frame."""
        return estimated if self.offset == 0.0 else turned_about_vertical(estimated, -self.offset)

    def target(self, target: Target) -> Target:
        """Convert a target of guidance to this frame.

        The given target has its horizontal part in the estimator's frame, and its heading in this
        frame already.
        """
        if self.offset == 0.0:
            return target
        north, east = rotate(target.north, target.east, -self.offset)
        return target._replace(north=north, east=east)
