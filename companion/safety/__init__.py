"""The safety ladder: what is watched while the autopilot obeys us, and what each breach means."""

from companion.safety.ladder import SafetyLadder, Verdict
from companion.safety.monitor import Action
from companion.safety.table import monitors

__all__ = ["Action", "SafetyLadder", "Verdict", "monitors"]
