"""Planned emergency stops, opened guards and errors, at once or some seconds from now."""

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property

from robolink.timing import NS_PER_S
from robolink_simulators.epson.panel import EpsonPanel
from robolink_simulators.faults import Fault, FaultAction


class EpsonMishaps:
    """Does to the panel what a fault plan says, when it says.

    Args:
        panel: What hands can touch.
        restart: Starts the controller anew.
    """

    def __init__(self, panel: EpsonPanel, restart: Callable[[], None]) -> None:
        self._panel = panel
        self._planned: list[tuple[int, Callable[[], None]]] = []
        self._restart = restart

    @cached_property
    def _acts(self) -> Mapping[FaultAction, Callable[[], None]]:
        """What hands do; made when something first goes wrong."""
        panel = self._panel
        return {
            FaultAction.ESTOP: panel.press_estop,
            FaultAction.GUARD_OPEN: panel.open_guard,
            FaultAction.SERIOUS_ERROR: panel.raise_serious_error,
            FaultAction.LOSE_LOGIN: panel.lose_login,
            FaultAction.TEACH_MODE: panel.teach,
            FaultAction.RESTART: self._restart,
        }

    def strike(self, faults: Sequence[Fault], now_ns: int) -> None:
        """Do what is due now, and note what comes later."""
        for fault in faults:
            act = self._act_of(fault)
            if act is None:
                continue
            self.plan(now_ns, fault.seconds, act)

    def plan(self, now_ns: int, seconds: float, act: Callable[[], None]) -> None:
        """Have something done some time from now; at once when that is no time at all."""
        if seconds > 0:
            self._planned.append((now_ns + round(seconds * NS_PER_S), act))
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
        if fault.action is FaultAction.DEVICE_FAULT:
            return lambda: self._panel.raise_error(fault.code)
        return self._acts.get(fault.action)
