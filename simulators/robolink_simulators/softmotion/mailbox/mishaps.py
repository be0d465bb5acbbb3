"""Planned restarts, failures and the like, and what arrives later than it should."""

from collections.abc import Mapping, Sequence

from robolink.timing import NS_PER_S
from robolink_simulators.device.planned_acts import Act, PlannedActs
from robolink_simulators.faults import PlcFault, PlcFaultAction
from robolink_simulators.softmotion.mailbox.panel import PlcPanel


class PlcMishaps(PlannedActs):
    """Does to the panel what a fault plan says, each act at its own instant."""

    def __init__(self, panel: PlcPanel) -> None:
        super().__init__()
        self._panel = panel
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
        self.plan_at(now_ns + max(1, round(seconds * NS_PER_S)), act)

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
