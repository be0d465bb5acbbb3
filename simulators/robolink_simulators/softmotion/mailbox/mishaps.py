"""Planned restarts, failures and the like, and what arrives later than it should."""

from collections.abc import Callable, Mapping, Sequence

from robolink.timing import NS_PER_S
from robolink_simulators.faults import PlcFault, PlcFaultAction
from robolink_simulators.softmotion.mailbox.panel import PlcPanel

Act = Callable[[], None]


class PlcMishaps:
    """Does to the panel what a fault plan says, each act at its own instant."""

    def __init__(self, panel: PlcPanel) -> None:
        self._panel = panel
        self._planned: list[tuple[int, Act]] = []
        self._acts: Mapping[PlcFaultAction, Act] = {
            PlcFaultAction.RESTART: panel.restart,
            PlcFaultAction.FREEZE: panel.freeze,
            PlcFaultAction.ZERO_INPUTS: panel.zero_inputs,
            PlcFaultAction.FREEZE_HEARTBEAT: panel.freeze_heartbeat,
            PlcFaultAction.TAKE_OWNERSHIP: panel.take_ownership,
            PlcFaultAction.ESTOP: panel.press_estop,
            PlcFaultAction.WITHDRAW_PERMIT: panel.withdraw_permit,
        }

    def strike(self, faults: Sequence[PlcFault], now_ns: int) -> None:
        """Plan what faults say about the PLC."""
        for fault in faults:
            act = self._act_of(fault)
            if act is not None:
                self.plan(now_ns, fault.seconds, act)

    def plan(self, now_ns: int, seconds: float, act: Act) -> None:
        """Have something done some time from now, not before the request is carried out."""
        self._planned.append((now_ns + max(1, round(seconds * NS_PER_S)), act))

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

    def _act_of(self, fault: PlcFault) -> Act | None:
        match fault.action:
            case PlcFaultAction.AXIS_ERROR:
                return lambda: self._panel.fail_axis(0, fault.code)
            case PlcFaultAction.WORD_ORDER:
                return lambda: self._panel.lay_words(fault.order)
            case PlcFaultAction.SHIFT_MAP:
                return lambda: self._panel.shift_map(fault.position or 1)
            case _:
                return self._acts.get(fault.action)
