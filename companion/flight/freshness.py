"""How old a sample is when it arrives, without a common clock."""

from math import inf


class SampleClock:
    """Ages samples against the quickest one: what came later than that was under way longer.

    The vehicle's clock and ours differ by an unknown offset; the smallest (receive time − vehicle
    time) seen is the quickest way through the link. The smallest is let rise by 100 ppm, so that
    two drifting clocks do not age every sample for ever.
    """

    _DRIFT = 1e-4

    def __init__(self) -> None:
        self._quickest = inf
        self._newest = -inf
        self._received = -inf

    def age(self, vehicle_time: float, received: float) -> float | None:
        """Age in s beyond the quickest sample's; None for one that is not newer than the last.

        Args:
            vehicle_time: the sample's own time, s since the autopilot's boot.
            received: when it arrived, s on our clock.
        """
        if vehicle_time <= self._newest:
            return None
        if self._received > -inf:
            self._quickest += self._DRIFT * (received - self._received)
        self._newest = vehicle_time
        self._received = received
        offset = received - vehicle_time
        self._quickest = min(self._quickest, offset)
        return offset - self._quickest
