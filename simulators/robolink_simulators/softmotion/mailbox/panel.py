"""What a person, or the rest of the machine, does to a simulated PLC outside the wire."""

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager

from robolink.messages import tr
from robolink.protocols.mailbox import WordOrder
from robolink.timing import NS_PER_S
from robolink_simulators.device.hosted import Act, PlannedActs
from robolink_simulators.faults import PlcFault, PlcFaultAction
from robolink_simulators.faults.fieldbus import Order
from robolink_simulators.not_now import NotNowError
from robolink_simulators.softmotion.kinematics.kinematics import CoordRef
from robolink_simulators.softmotion.mailbox.plc import Plc
from robolink_simulators.softmotion.signals import SIGNALS
from robolink_simulators.softmotion.smc_errors import BlockRefused

_LAG_ERROR = 16
"""Number of the lag error in SMC_ERROR (docs/reference/softmotion.md 1.4)."""


class PlcPanel:
    """Buttons, drives, the machine's own program. Any thread may act.

    Args:
        plc: The controller.
        acting: Surrounds each act: keeps other threads out, gives the present time, and tells
            hosts afterwards to look.
    """

    def __init__(self, plc: Plc, acting: Callable[[], AbstractContextManager[int]]) -> None:
        self._plc = plc
        self._acting = acting

    def press_estop(self) -> None:
        """Press the emergency stop: the drives lose their power."""
        with self._acting():
            self._plc.estop_pressed = True
            self._plc.group.power(on=False)

    def release_estop(self) -> None:
        """Release it: the machine's program switches the drives on again."""
        with self._acting():
            self._plc.estop_pressed = False
            self._plc.group.power(on=True)

    def give_permit(self) -> None:
        """Let the machine permit changes (``xPermit``)."""
        with self._acting():
            self._plc.program.permitted = True

    def withdraw_permit(self) -> None:
        """Let the machine no longer permit changes; what moves ends in the next cycle."""
        with self._acting():
            self._plc.program.permitted = False

    @property
    def tool_changed(self) -> bool:
        """Whether a client has changed a tool (``xToolChanged``)."""
        with self._acting():
            return self._plc.memory.tool_changed

    @property
    def owned(self) -> bool:
        """Whether a client owns the mailbox."""
        with self._acting():
            return self._plc.program.holder != 0

    def take_change_back(self) -> None:
        """Let the machine's own program confirm that it knows of the change (``xToolChanged``)."""
        with self._acting():
            self._plc.memory.tool_changed = False

    def fail_axis(self, number: int = 0, error_number: int = _LAG_ERROR) -> None:
        """Let a drive fail.

        Raises:
            NotNowError: There is no such axis.
        """
        with self._acting():
            self._require_axis(number)
            self._plc.group.fail_axis(number, error_number)

    def move_axis(self, number: int, target: float) -> None:
        """Let the machine's own program move one axis by itself; degrees or mm.

        Raises:
            NotNowError: There is no such axis, or its drive refuses.
        """
        with self._acting():
            self._require_axis(number)
            error = self._plc.group.move_axis(number, target).outputs.error
            if error is not None:
                raise NotNowError(
                    tr("Axis {number} does not move: {cause}.", number=number, cause=error.text),
                    remedy=tr("Look at the state of the group and of the drive."),
                )

    def set_tool(self, tool: CoordRef) -> None:
        """Let the machine's own program set a tool, which the mailbox then does not know.

        Raises:
            NotNowError: The group refuses it.
        """
        with self._acting():
            error = self._plc.group.set_tool(tool).outputs.error
            if error is not None:
                raise NotNowError(
                    tr("The tool cannot be set: {cause}.", cause=error.text),
                    remedy=tr("Look at the state of the group and at its kinematics."),
                )

    def switch_input(self, number: int, on: bool) -> None:
        """Switch an input by hand.

        Raises:
            NotNowError: There is no such input.
        """
        with self._acting():
            try:
                self._plc.group.inputs.switch(number, on)
            except BlockRefused as refused:
                raise NotNowError(
                    tr("There is no input {number}.", number=number),
                    remedy=tr("Inputs are 0 to {last}.", last=SIGNALS - 1),
                ) from refused

    def zero_inputs(self) -> None:
        """Let the fieldbus zero what clients have written, as its watchdog does."""
        with self._acting() as now_ns:
            self._plc.program.zero_inputs(now_ns)

    def freeze(self) -> None:
        """Stop the mailbox program, with its heartbeat; what moves continues."""
        with self._acting() as now_ns:
            self._plc.freeze(now_ns)

    def thaw(self) -> None:
        """Continue the mailbox program."""
        with self._acting():
            self._plc.thaw()

    def freeze_heartbeat(self) -> None:
        """Stop only the heartbeat, as when only the motion task has died (F69)."""
        with self._acting() as now_ns:
            self._plc.freeze_heartbeat(now_ns)

    def lay_words(self, order: Order) -> None:
        """Change the program so that it lays values of several words in another order (F33)."""
        with self._acting():
            self._plc.lay_words(WordOrder[order.upper()])

    def shift_map(self, words: int) -> None:
        """Change the project: clients read and write so many words behind what they mean (F34)."""
        with self._acting():
            self._plc.shift = words

    def take_ownership(self) -> None:
        """Let another client insist on the mailbox (F46)."""
        with self._acting() as now_ns:
            self._plc.program.seize(now_ns)

    def cut_link(self) -> None:
        """Pull the cable of every client; a line or a bus has no connection that would end."""
        with self._acting():
            self._plc.cuts += 1

    def restart(self) -> None:
        """Restart the PLC; what is retained stays."""
        with self._acting() as now_ns:
            self._plc.start(now_ns)

    def _require_axis(self, number: int) -> None:
        count = len(self._plc.group.axes)
        if not 0 <= number < count:
            raise NotNowError(
                tr("There is no axis {number}.", number=number),
                remedy=tr("Axes are 0 to {last}.", last=count - 1),
            )


class PlcMishaps(PlannedActs):
    """Applies the acts of a fault plan to the panel, each at its own instant."""

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

    def plan(self, now_ns: int, seconds: float, act: Act) -> None:
        """Plan an act some time from now, not before the request is carried out."""
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
