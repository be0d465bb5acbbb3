"""Planned emergency stops, opened guards and errors, at once or some seconds from now."""

from collections.abc import Mapping, Sequence
from functools import cached_property

from robolink.timing import NS_PER_S
from robolink_simulators.device.hosted import Act, PlannedActs
from robolink_simulators.epson.panel import EpsonPanel
from robolink_simulators.faults import Fault, FaultAction


class EpsonMishaps(PlannedActs):
    """Does to the panel what a fault plan says, when it says.

    Args:
        panel: What hands can touch.
        restart: Starts the controller anew.
    """

    def __init__(self, panel: EpsonPanel, restart: Act) -> None:
        super().__init__()
        self._panel = panel
        self._restart = restart

    @cached_property
    def _acts(self) -> Mapping[FaultAction, Act]:
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

    def plan(self, now_ns: int, seconds: float, act: Act) -> None:
        """Have something done some time from now; at once when that is no time at all."""
        if seconds > 0:
            self.plan_at(now_ns + round(seconds * NS_PER_S), act)
        else:
            act()

    def _act_of(self, fault: Fault) -> Act | None:
        if fault.action is FaultAction.DEVICE_FAULT:
            return lambda: self._panel.raise_error(fault.code)
        return self._acts.get(fault.action)
