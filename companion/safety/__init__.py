"""The safety ladder: monitors judge snapshots in flight, and each breach leads to an action."""

from companion.safety.actions import Action
from companion.safety.ladder import SafetyLadder, Verdict
from companion.safety.table import monitors

__all__ = ["Action", "SafetyLadder", "Verdict", "monitors"]
