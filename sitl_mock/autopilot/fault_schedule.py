"""Which faults are active when: the schedule in vehicle time."""

from dataclasses import dataclass

from sitl_mock.config.faults import LinkFault, VehicleFault


@dataclass
class _Entry:
    fault: LinkFault | VehicleFault
    given_us: int
    active: bool = False
    over: bool = False


class FaultSchedule:
    """The faults asked so far, and those active now.

    Args:
        faults: known from the start.
    """

    def __init__(self, faults: tuple[LinkFault | VehicleFault, ...]) -> None:
        self._entries = [_Entry(fault, 0) for fault in faults]
        self.link: tuple[LinkFault, ...] = ()

    def add(self, fault: LinkFault | VehicleFault, now_us: int) -> None:
        """Ask for a fault; without a start condition it begins at the next update."""
        self._entries.append(_Entry(fault, now_us))

    def clear(self) -> list[VehicleFault]:
        """Forget all faults, and return the vehicle's that were active."""
        active = [e.fault for e in self._entries if e.active and not isinstance(e.fault, LinkFault)]
        self._entries = []
        self.link = ()
        return active

    def update(
        self, now_us: int, offboard_us: int | None
    ) -> tuple[list[VehicleFault], list[VehicleFault]]:
        """Move on to a time, and return the vehicle's faults that began and that ended.

        Args:
            now_us: vehicle time.
            offboard_us: when OFFBOARD was first entered armed, None if not yet.
        """
        began: list[VehicleFault] = []
        ended: list[VehicleFault] = []
        changed = False
        for entry in self._entries:
            active = self._is_active(entry, now_us, offboard_us)
            if active == entry.active:
                continue
            changed = True
            entry.active = active
            entry.over = not active
            if not isinstance(entry.fault, LinkFault):
                (began if active else ended).append(entry.fault)
        if changed:
            self._entries = [entry for entry in self._entries if not entry.over]
            self.link = tuple(
                e.fault for e in self._entries if e.active and isinstance(e.fault, LinkFault)
            )
        return began, ended

    @staticmethod
    def _is_active(entry: _Entry, now_us: int, offboard_us: int | None) -> bool:
        fault = entry.fault
        if fault.after_offboard_s is not None:
            if offboard_us is None:
                return False
            start = max(offboard_us + fault.after_offboard_s * 1e6, entry.given_us)
        elif fault.at_s is not None:
            start = max(fault.at_s * 1e6, entry.given_us)
        else:
            start = entry.given_us
        if now_us < start:
            return False
        return fault.duration_s is None or now_us < start + fault.duration_s * 1e6
