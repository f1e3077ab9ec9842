"""The study put together: what is flown, and the page's section made of it."""

from companion.study.nmpc import contest, tables
from companion.study.nmpc.cold_start import count_iterations
from companion.study.nmpc.exchange import time_exchange
from companion.study.nmpc.figure import CAPTION, draw_figure
from companion.study.nmpc.findings import find
from companion.study.outcome import Outcome, Tick

PARTS = contest.SECONDS + 2


def run(tick: Tick) -> Outcome:
    """Solve from cold, time the process, and fly all models side by side.

    Raises:
        ChildProcessError: the solver's process does not come up.
    """
    tick("cold starts")
    counts = count_iterations()
    tick("the solver's process")
    exchange = time_exchange()
    flown = contest.fly_contest(tick)
    return Outcome(
        name="nmpc",
        title="Predictive control: what each prediction model costs, and what it is worth",
        conditions=(
            "A horizon of 1 s in 20 steps, the same cost for all models, Gauss–Newton SQP by"
            " CasADi with HPIPM, at 50 Hz. The vehicle is a point mass with 1 s⁻¹ of drag, flown"
            " by model-following (p = 5 s⁻¹, 50° of tilt, 120 °/s) behind a rate loop with 45 ms"
            " of dead time and 25 ms of lag. The models (34), (37) and (39) are the paper's, with"
            " drag; they have no limits but that of the thrust. Ours adds the limits of tilt and"
            " rate and the second-order response. Solve times are of this machine, as it was."
        ),
        figure=draw_figure(flown),
        caption=CAPTION,
        tables=(
            tables.time_table(flown),
            tables.cold_start_table(counts),
            tables.error_table(flown),
            tables.exchange_table(exchange),
        ),
        findings=find(flown, counts, exchange),
        series=(tables.series(flown),),
    )
