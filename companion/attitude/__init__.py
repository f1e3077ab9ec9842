"""The control law: an attitude and a target in, body rates out.

    >>> from companion.attitude import Limits, Target, make_planner
    >>> planner = make_planner("first-order", gain=5.0, limits=Limits(max_tilt=0.6))
    >>> planner.rates((1.0, 0.0, 0.0, 0.0), Target(north=0.2, east=0.0, heading=0.0), dt=0.004)
    BodyRates(roll=0.0, pitch=-1.0, yaw=0.0)

The vehicle pitches nose down, towards north. A call computes one step on plain floats, without I/O,
clock, configuration or arrays.
World NED, body FRD; SI units and radians. Quaternions are (w, x, y, z), Hamilton product, body to
world.
Each name below has its own page: `help(companion.attitude.make_planner)`.

Planners
    make_planner    a planner by its name, or from your own law
    Planner         what each planner can do: `rates`, `reset`, `note_attitude_target`
    Limits          the largest tilt, tilt rate and yaw rate
    PLANNER_NAMES   all planners; LAW_NAMES: those without memory, which `companion.batch` maps
    Law, Constants  the form of your own law: a function on plain floats, and its gains and limits
    LawPlanner      the planner that applies a law
    limit_rates     body rates within their limits, for your own law

In and out
    Quaternion      (w, x, y, z), a tuple of floats
    Target          the wanted coefficients and heading: north, east, heading, heading_rate
    BodyRates       roll, pitch, yaw in rad/s
    Coefficients    north, east: horizontal acceleration per specific thrust
    TiltYaw         a, b, x, y, z of `decompose`

Functions
    coefficients    the acceleration coefficients of an attitude
    heading         the tilt-yaw heading of an attitude, rad
    attitude        the attitude with given coefficients and heading
    decompose       an attitude as tilt ⊗ yaw
    is_unit         whether a planner accepts this quaternion
    wrap_angle      an angle in (−π, π]

Errors, all of them `AttitudeError` (a `ValueError`)
    InvalidQuaternionError, InvalidTargetError, InvalidBodyRatesError, InvalidPeriodError

The law is that of Xu & Pei, *Attitude Controller for UAV First-Order Acceleration Coefficients
Tracking*, Sensors 2026, 26(9), 2727; equation numbers in this package are that paper's.
"""

# Without `__all__`: with it, help() prints the methods of tuples for 800 lines. A name imported as
# itself is public.
from companion.attitude.limits import Constants as Constants
from companion.attitude.limits import Limits as Limits
from companion.attitude.planner import LAW_NAMES as LAW_NAMES
from companion.attitude.planner import PLANNER_NAMES as PLANNER_NAMES
from companion.attitude.planner import Law as Law
from companion.attitude.planner import LawPlanner as LawPlanner
from companion.attitude.planner import Planner as Planner
from companion.attitude.planner import make_planner as make_planner
from companion.attitude.representation import attitude as attitude
from companion.attitude.representation import coefficients as coefficients
from companion.attitude.representation import decompose as decompose
from companion.attitude.representation import heading as heading
from companion.attitude.representation import is_unit as is_unit
from companion.attitude.representation import wrap_angle as wrap_angle
from companion.attitude.rotation import limit_rates as limit_rates
from companion.attitude.types import AttitudeError as AttitudeError
from companion.attitude.types import BodyRates as BodyRates
from companion.attitude.types import Coefficients as Coefficients
from companion.attitude.types import InvalidBodyRatesError as InvalidBodyRatesError
from companion.attitude.types import InvalidPeriodError as InvalidPeriodError
from companion.attitude.types import InvalidQuaternionError as InvalidQuaternionError
from companion.attitude.types import InvalidTargetError as InvalidTargetError
from companion.attitude.types import Quaternion as Quaternion
from companion.attitude.types import Target as Target
from companion.attitude.types import TiltYaw as TiltYaw
