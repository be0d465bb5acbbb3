"""Planned emergency stops, opened guards and errors, at once or some seconds from now."""

from collections.abc import Callable, Sequence

from robolink.timing import NS_PER_S
from robolink_simulators.epson.panel import EpsonPanel
from robolink_simulators.faults import Fault, FaultAction


class EpsonMishaps:
    """Does to the panel what a fault plan says, when it says."""

    def __init__(self, panel: EpsonPanel) -> None:
        self._panel = panel
        self._planned: list[tuple[int, Callable[[], None]]] = []

    def strike(self, faults: Sequence[Fault], now_ns: int) -> None:
        """Do what is due now, and note what comes later."""
        for fault in faults:
            act = self._act_of(fault)
            if act is None:
                continue
            if fault.seconds > 0:
                self._planned.append((now_ns + round(fault.seconds * NS_PER_S), act))
            else:
                act()

    def next_change(self) -> int | None:
        """Return when the next one is due."""
        return min(at_ns for at_ns, _ in self._planned) if self._planned else None

    def carry_out(self, now_ns: int) -> None:
        """Do what is due by now."""
        if not self._planned:
            return
        due = [act for at_ns, act in self._planned if at_ns <= now_ns]
        self._planned = [plan for plan in self._planned if plan[0] > now_ns]
        for act in due:
            act()

    def forget(self) -> None:
        """Plan nothing any more."""
        self._planned.clear()

    def _act_of(self, fault: Fault) -> Callable[[], None] | None:
        match fault.action:
            case FaultAction.ESTOP:
                return self._panel.press_estop
            case FaultAction.GUARD_OPEN:
                return self._panel.open_guard
            case FaultAction.DEVICE_FAULT:
                return lambda: self._panel.raise_error(fault.code)
            case _:
                return None
