"""Past the paper: every planner behind a rate loop with dead time and lag.

`grid` flies them over dead times, lags and sample rates, `case` one of those cases in full, and
`complete` the complete inner loop of figure 5; `belief` is what model-following takes for true.
"""

from companion.study.lag.study import PARTS, run

__all__ = ["PARTS", "run"]
