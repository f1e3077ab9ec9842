"""The safety ladder: what is watched while the autopilot obeys us, and what each breach means."""

from companion.flight.safety.ladder import SafetyLadder, Verdict
from companion.flight.safety.lookout import Lookout
from companion.flight.safety.monitor import Action
from companion.flight.safety.table import monitors

__all__ = ["Action", "Lookout", "SafetyLadder", "Verdict", "monitors"]
