"""Guidance of another package; an exception of its code is reported as that package's error."""

from companion.attitude import Target
from companion.guidance.linear import Guidance, GuidanceInput, LinearCommand
from companion.guidance.reference import ReferenceAt
from companion.user_code import naming_user_code


class PluginGuidance:
    """Calls the guidance of another package.

    Attributes:
        guidance: the guidance of another package.
    """

    def __init__(self, guidance: Guidance) -> None:
        self.guidance = guidance

    @property
    def effect_delay(self) -> float:
        """Like `Guidance.effect_delay`, s; raises `UserCodeError` like `command`."""
        with naming_user_code("guidance", self.guidance):
            return float(self.guidance.effect_delay)

    def command(
        self, reference_at: ReferenceAt, time: float, inputs: GuidanceInput
    ) -> LinearCommand:
        """See `LinearGuidance.command`.

        Raises:
            UserCodeError: the guidance raised, or did not return what a `LinearCommand` holds.
        """
        with naming_user_code("guidance", self.guidance):
            target, later, down = self.guidance.command(reference_at, time, inputs)
            # A number of NumPy is as good as a float; anything else is an error of the guidance.
            return LinearCommand(
                Target(*map(float, target)), Target(*map(float, later)), float(down)
            )
