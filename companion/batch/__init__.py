"""Many vehicles at once: the laws of `companion.attitude`, mapped over arrays.

    >>> from companion import batch
    >>> from companion.attitude import make_planner
    >>> level, north = [[1.0], [0.0], [0.0], [0.0]], [[0.2], [0.0], [0.0], [0.0]]  # one vehicle
    >>> history = batch.simulate(make_planner("exact", gain=5.0), level, north, dt=0.01, steps=20)
    >>> batch.coefficients(history.q)[-1].round(4).tolist()  # after 1/p: 1 − 1/e of the way
    [[0.1264], [0.0]]

Arrays are float64, component first: quaternions (4, n), targets (4, n), body rates (3, n).
This package contains no control law. With numba (extra `study`) and from `MIN_STEPS_TO_COMPILE`
steps on, the functions that a flight calls are compiled, and the processor works on several
vehicles in one instruction. Otherwise the functions are called for one vehicle after the other. In
a simulation loop of your own, in which each call is a few steps, pass `compiled=True`: 1000
vehicles take 0.2 ms instead of 17 ms.

    rates         body rates of many vehicles
    advance       attitudes after some samples
    simulate      every attitude and body rate on the way: a `History`
    coefficients  acceleration coefficients of many attitudes
    can_compile   whether numba is installed; MIN_STEPS_TO_COMPILE: steps from which that is faster

The planner must be one without memory (`companion.attitude.LAW_NAMES`, or a law of your own).
"""

# Without `__all__`: see `companion.attitude`.
from companion.batch.batch import MIN_STEPS_TO_COMPILE as MIN_STEPS_TO_COMPILE
from companion.batch.batch import History as History
from companion.batch.batch import advance as advance
from companion.batch.batch import can_compile as can_compile
from companion.batch.batch import coefficients as coefficients
from companion.batch.batch import rates as rates
from companion.batch.batch import simulate as simulate
