"""Proposes planner gain, guidance weights and observer bandwidth for an identified vehicle.

    >>> from pathlib import Path
    >>> from companion.config.files import changed, load, shipped
    >>> from companion.tuning import propose
    >>> config = load(shipped("px4.yaml"))
    >>> proposal = propose(config)
    >>> tuned = changed(config, proposal.changes, "tune")
    >>> proposal.after.margins.gain_db >= 6.0, proposal.after.margins.phase_deg >= 30.0
    (True, True)

`companion.tuning.flights` flies a proposal on the mock vehicle. This package does not import
`companion.tuning.flights`, because that module needs `companion.testing`.

A proposal
    propose        a `Proposal` for a configuration
    Proposal       the values, `changes` for `companion.config.files.changed`, what to expect
    Aims           the stability margins to keep, and how much of the rate limit may be used
    Design         the values that are searched

The analysis
    expectation    margins, errors, rates and settling of a configuration: an `Expectation`
    stability      the margins only, also with errors of lag and dead time: `ModelMismatch`
    Disturbances   what disturbs the vehicle
    control_loop   frequency responses of the whole loop: a `Loop`
"""

# Without `__all__`: see `companion.attitude`.
from companion.tuning.expectation import Disturbances as Disturbances
from companion.tuning.expectation import Expectation as Expectation
from companion.tuning.expectation import expectation as expectation
from companion.tuning.expectation import stability as stability
from companion.tuning.loop import Loop as Loop
from companion.tuning.loop import ModelMismatch as ModelMismatch
from companion.tuning.loop import control_loop as control_loop
from companion.tuning.margins import Margins as Margins
from companion.tuning.proposal import Proposal as Proposal
from companion.tuning.proposal import propose as propose
from companion.tuning.search import Aims as Aims
from companion.tuning.search import Design as Design
