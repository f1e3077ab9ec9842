"""Trajectories: curves in space with a time law, sampled up to the jerk.

    >>> from math import radians
    >>> from companion.guidance.trajectory import Envelope, Laps, circle, slow_down, violations
    >>> path = circle(radius=5.0, laps=Laps(speed=8.0))  # 8 m/s on 5 m of radius
    >>> limits = Envelope(max_tilt=radians(35.0))
    >>> print(violations(path, limits)[0].limit)
    limits.max_tilt_deg
    >>> slowed = slow_down(path, limits)
    >>> violations(slowed.trajectory, limits)
    ()

World NED, SI units, radians; positions are relative to where the trajectory begins. Each name below
has its own page: `help(companion.guidance.trajectory.waypoints)`.

A trajectory
    Trajectory       protocol: any class with its members is a trajectory
    Sample           position, velocity, acceleration, jerk, heading and heading rate at one instant
    TrajectoryError  a trajectory cannot be made or flown; the text is for the user
    Vector           (north, east, down)

Made from a shape
    Hover            stay at the start
    line             straight, from rest to rest
    circle, helix    laps of a circle, level or rising; `Laps` says how
    Laps             speed, number, acceleration and direction of laps
    steady_circle    the circle of `flight.maneuvers`
    gerono_eight, bernoulli_eight  figures-eight
    waypoints        through points without a stop, on a smooth curve
    straight_legs    through points on straight lines, with a stop at each

Made from a table
    read_csv         samples of a CSV file: a `Table`
    Table            times, positions, derivatives and yaw
    from_samples     a smooth trajectory through samples
    SampleOptions    how to read them: Frame, HeadingFrom, smoothing
    Frame, HeadingFrom

Checked
    require_trajectory  checks a trajectory of your own class: its members and its derivatives
    Envelope         limits; None is no limit
    violations       the limits that a trajectory breaks: each a `Violation`
    slow_down        slows a trajectory down until it keeps the limits: a `SlowDown`
    SlowDown         the slower trajectory, and what slowed it; parts: SlowedPart
    evenly_slowed    slows the whole trajectory down by one factor
    Violation        a broken limit, when it is broken, and what to do
    Slowed           a trajectory flown more slowly; SlowerTime: its time law
    motion_violations  like `violations`, for a `Motion`, which is given as arrays
    Motion
    turned_first     a turn on the spot before a trajectory that begins with a heading
    reporting_numerical_errors  turns numerical errors into a `TrajectoryError`
    LONGEST_DURATION  longest duration that is checked, s
    LARGEST_COORDINATE, LARGEST_SPEED  bounds of coordinates and speeds in files, m and m/s
"""

# Without `__all__`: with it, help() prints the methods of every tuple. A name imported as itself is
# public.
from companion.guidance.trajectory.csv_file import Table as Table
from companion.guidance.trajectory.csv_file import read_csv as read_csv
from companion.guidance.trajectory.demand import Motion as Motion
from companion.guidance.trajectory.derived import SlowDown as SlowDown
from companion.guidance.trajectory.derived import Slowed as Slowed
from companion.guidance.trajectory.derived import SlowedPart as SlowedPart
from companion.guidance.trajectory.derived import evenly_slowed as evenly_slowed
from companion.guidance.trajectory.derived import turned_first as turned_first
from companion.guidance.trajectory.feasibility import Envelope as Envelope
from companion.guidance.trajectory.feasibility import Violation as Violation
from companion.guidance.trajectory.feasibility import motion_violations as motion_violations
from companion.guidance.trajectory.feasibility import violations as violations
from companion.guidance.trajectory.figures import Hover as Hover
from companion.guidance.trajectory.figures import Laps as Laps
from companion.guidance.trajectory.figures import bernoulli_eight as bernoulli_eight
from companion.guidance.trajectory.figures import circle as circle
from companion.guidance.trajectory.figures import gerono_eight as gerono_eight
from companion.guidance.trajectory.figures import helix as helix
from companion.guidance.trajectory.figures import line as line
from companion.guidance.trajectory.figures import steady_circle as steady_circle
from companion.guidance.trajectory.from_samples import Frame as Frame
from companion.guidance.trajectory.from_samples import HeadingFrom as HeadingFrom
from companion.guidance.trajectory.from_samples import SampleOptions as SampleOptions
from companion.guidance.trajectory.from_samples import from_samples as from_samples
from companion.guidance.trajectory.own_trajectory import require_trajectory as require_trajectory
from companion.guidance.trajectory.sample import LARGEST_COORDINATE as LARGEST_COORDINATE
from companion.guidance.trajectory.sample import LARGEST_SPEED as LARGEST_SPEED
from companion.guidance.trajectory.sample import LONGEST_DURATION as LONGEST_DURATION
from companion.guidance.trajectory.sample import Sample as Sample
from companion.guidance.trajectory.sample import Trajectory as Trajectory
from companion.guidance.trajectory.sample import TrajectoryError as TrajectoryError
from companion.guidance.trajectory.sample import Vector as Vector
from companion.guidance.trajectory.sample import (
    reporting_numerical_errors as reporting_numerical_errors,
)
from companion.guidance.trajectory.slower_time import SlowerTime as SlowerTime
from companion.guidance.trajectory.slowing import slow_down as slow_down
from companion.guidance.trajectory.straight_legs import straight_legs as straight_legs
from companion.guidance.trajectory.waypoints import waypoints as waypoints
