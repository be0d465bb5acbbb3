"""What a person, or the rest of the cell, does to the controller outside the wire; and mishaps."""

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from functools import cached_property

from robolink.messages import tr
from robolink.timing import NS_PER_S
from robolink_simulators.device.hosted import Act, PlannedActs
from robolink_simulators.epson.condition import Condition, Mode, SpelRefusal, Task
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.memory.bits import IO_BITS
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.epson.remote.command_window import SpelWindow
from robolink_simulators.epson.remote.commands import Alarms
from robolink_simulators.epson.remote.link import ClientSlot
from robolink_simulators.faults import Fault, FaultAction
from robolink_simulators.not_now import NotNowError


class EpsonPanel:
    """Buttons, doors, selector, errors: what hands can reach. Any thread may act.

    Args:
        machine: The robot.
        condition: The state that GetStatus shows.
        window: The statement that may be running.
        slot: The client that may be logged in.
        alarms: The alarms that stand.
        options: For the error numbers.
        acting: Surrounds each act: keeps other threads out, gives the present time, and tells
            a host afterwards to look for what leaves now.

    Attributes:
        starter: Starts the function of that number, where a program is loaded.
    """

    def __init__(
        self,
        machine: Machine,
        condition: Condition,
        window: SpelWindow,
        slot: ClientSlot,
        alarms: Alarms,
        *,
        options: EpsonOptions,
        acting: Callable[[], AbstractContextManager[int]],
    ) -> None:
        self._machine = machine
        self._condition = condition
        self._window = window
        self._slot = slot
        self._alarms = alarms
        self._numbers = options.numbers
        self._outputs_off_at_estop = options.outputs_off_at_estop
        self._acting = acting
        self.starter: Callable[[int], object] | None = None

    def press_estop(self) -> None:
        """Press the emergency stop: the arm stops, the motors are off, an Execute fails."""
        with self._acting() as now_ns:
            self._condition.press_estop()
            if self._outputs_off_at_estop:
                self._machine.clear_outputs()
            self._cut_power(self._numbers.emergency_stop, "Emergency stop", now_ns)

    def release_estop(self) -> None:
        """Release the button; the stop remains active until Reset."""
        with self._acting():
            self._condition.release_estop()

    def open_guard(self) -> None:
        """Open the safety door: like the emergency stop, but a task pauses (motors assumed)."""
        with self._acting() as now_ns:
            self._condition.open_guard()
            self._machine.keep_places(now_ns)
            self._cut_power(self._numbers.guard_open, "Safeguard open", now_ns)

    def close_guard(self) -> None:
        """Close the safety door. Nothing continues by itself."""
        with self._acting():
            self._condition.guard_open = False

    def raise_error(self, number: int, *, serious: bool = False) -> None:
        """Put the controller into its error state; a serious one needs a restart."""
        with self._acting() as now_ns:
            self._machine.halt(now_ns)
            self._window.fail(number, f"Error {number}", now_ns)
            self._condition.raise_error(number, serious=serious)

    def raise_serious_error(self) -> None:
        """Raise an error that only a restart clears."""
        self.raise_error(self._numbers.serious, serious=True)

    def raise_warning(self, number: int) -> None:
        """Show a warning."""
        with self._acting():
            self._condition.raise_warning(number)

    def raise_alarm(self, alarm: int) -> None:
        """Add an alarm to what GetAlm lists."""
        with self._acting():
            self._alarms.raise_alarm(alarm)

    def switch_input(self, number: int, on: bool) -> None:
        """Switch an input by hand; whatever waits for it continues.

        Raises:
            NotNowError: There is no such input.
        """
        with self._acting():
            try:
                self._machine.inputs.set(number, on)
            except SpelRefusal as refused:
                raise NotNowError(
                    tr("There is no input {number}.", number=number),
                    remedy=tr("Inputs are 0 to {last}.", last=IO_BITS - 1),
                ) from refused

    def teach(self) -> None:
        """Turn the mode selector to TEACH."""
        self.set_mode(Mode.TEACH)

    def auto(self) -> None:
        """Turn the mode selector to AUTO."""
        self.set_mode(Mode.AUTO)

    def set_mode(self, mode: Mode) -> None:
        """Turn the mode selector; running tasks end without an error (assumed)."""
        with self._acting() as now_ns:
            if mode is not self._condition.mode:
                self._condition.mode = mode
                self._condition.task = Task.NONE
                self._window.interrupt(now_ns)

    def set_monitoring_only(self, on: bool) -> None:
        """Give control of the cell to another device, or back to Remote Ethernet."""
        with self._acting():
            self._condition.monitoring_only = on

    def start_production(self) -> None:
        """Start the production task from the cell's own control device.

        Raises:
            Refusal: The program that is loaded has no function main.
        """
        with self._acting():
            if self.starter is not None:
                self.starter(0)
            self._condition.task = Task.RUNNING

    def stop_production(self) -> None:
        """End the production task."""
        with self._acting():
            self._condition.task = Task.NONE
            self._machine.reset_motion_parameters()

    def lose_login(self) -> None:
        """Make the controller forget its login; the connection stays (F15)."""
        with self._acting():
            self._slot.free()

    def cut_link(self) -> None:
        """Pull the cable of the client that is logged in."""
        with self._acting():
            if self._slot.client is not None:
                self._slot.client.cut()

    def _cut_power(self, number: int, text: str, now_ns: int) -> None:
        self._machine.halt(now_ns)
        self._machine.switch_all_motors(False)
        self._window.fail(number, text, now_ns)


class EpsonMishaps(PlannedActs):
    """Applies the acts of a fault plan to the panel, at their time.

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
        """The acts of hands; made when something first goes wrong."""
        panel = self._panel
        return {
            FaultAction.ESTOP: panel.press_estop,
            FaultAction.GUARD_OPEN: panel.open_guard,
            FaultAction.SERIOUS_ERROR: panel.raise_serious_error,
            FaultAction.LOSE_LOGIN: panel.lose_login,
            FaultAction.TEACH_MODE: panel.teach,
            FaultAction.RESTART: self._restart,
        }

    def plan(self, now_ns: int, seconds: float, act: Act) -> None:
        """Plan an act some time from now; without a delay do it at once."""
        if seconds > 0:
            self.plan_at(now_ns + round(seconds * NS_PER_S), act)
        else:
            act()

    def _act_of(self, fault: Fault) -> Act | None:
        if fault.action is FaultAction.DEVICE_FAULT:
            return lambda: self._panel.raise_error(fault.code)
        return self._acts.get(fault.action)
