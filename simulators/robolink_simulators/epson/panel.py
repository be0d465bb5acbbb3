"""What a person or the rest of the cell does to the controller, past the wire."""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from robolink.protocols.epson_text import StatusFlags
from robolink_simulators.epson.client_slot import ClientSlot
from robolink_simulators.epson.condition import Condition, Mode, Task
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.epson.queries import Alarms
from robolink_simulators.epson.window import CommandWindow


class Panel:
    """Buttons, doors, selector, errors: the half of the simulator that hands can touch.

    Any thread may act; each act happens at the present time of whoever serves the simulator.

    Attributes:
        lock: Held by whoever touches the simulator while a host serves it.
        options: The controller's habits.
        machine: The robot and its memory.
        condition: What GetStatus shows.
        alarms: The alarms that stand.
        watchers: Called after each act, so that a host looks for what leaves now.
        present_ns: Tells the present time; a host sets it. Without one, an act happens at the
            instant that the simulator was given last.
    """

    options: EpsonOptions
    machine: Machine
    condition: Condition
    alarms: Alarms
    _window: CommandWindow
    _slot: ClientSlot

    def __init__(self) -> None:
        self.lock = threading.RLock()
        self.watchers: list[Callable[[], None]] = []
        self.present_ns: Callable[[], int] | None = None
        self._now_ns = 0
        self._stepping = False

    @property
    def now_ns(self) -> int:
        """The instant last given."""
        return self._now_ns

    def advance(self, now_ns: int) -> None:
        """Let simulated time reach ``now_ns``."""
        raise NotImplementedError

    def status_flags(self) -> StatusFlags:
        """Return the flags as GetStatus would show them."""
        with self.lock:
            return self.condition.flags(executing=self._window.busy)

    def press_estop(self) -> None:
        """Press the emergency stop: the arm stands, the motors are off, an Execute fails."""
        with self._act():
            self.condition.press_estop()
            self._cut_power(self.options.numbers.emergency_stop, "Emergency stop")

    def release_estop(self) -> None:
        """Release the button; the stop stays in force until Reset."""
        with self._act():
            self.condition.release_estop()

    def open_guard(self) -> None:
        """Open the safety door: as the emergency stop, but a task pauses (motors assumed)."""
        with self._act():
            self.condition.open_guard()
            self._cut_power(self.options.numbers.guard_open, "Safeguard open")

    def close_guard(self) -> None:
        """Close the safety door. Nothing goes on by itself."""
        with self._act():
            self.condition.guard_open = False

    def raise_error(self, number: int, *, serious: bool = False) -> None:
        """Put the controller into its error state; a serious one needs a restart."""
        with self._act():
            self.machine.arm.halt(self._now_ns)
            self._window.fail(number, f"Error {number}", self._now_ns)
            self.condition.raise_error(number, serious=serious)

    def raise_serious_error(self) -> None:
        """Raise the error that only a restart clears."""
        self.raise_error(self.options.numbers.serious, serious=True)

    def raise_warning(self, number: int) -> None:
        """Show a warning."""
        with self._act():
            self.condition.raise_warning(number)

    def raise_alarm(self, alarm: int) -> None:
        """Add an alarm to what GetAlm lists."""
        with self._act():
            self.alarms.raise_alarm(alarm)

    def teach(self) -> None:
        """Turn the mode selector to TEACH."""
        self.set_mode(Mode.TEACH)

    def auto(self) -> None:
        """Turn the mode selector to AUTO."""
        self.set_mode(Mode.AUTO)

    def set_mode(self, mode: Mode) -> None:
        """Turn the mode selector; what runs ends without an error (assumed)."""
        with self._act():
            if mode is not self.condition.mode:
                self.condition.mode = mode
                self.condition.task = Task.NONE
                self._window.interrupt(self._now_ns)

    def set_monitoring_only(self, on: bool) -> None:
        """Hand the cell to another control device, or back to Remote Ethernet."""
        with self._act():
            self.condition.monitoring_only = on

    def start_production(self) -> None:
        """Start the endless production task from the cell's own control device."""
        with self._act():
            self.condition.task = Task.RUNNING

    def stop_production(self) -> None:
        """End the production task."""
        with self._act():
            self.condition.task = Task.NONE
            self.machine.reset_motion_parameters()

    def cut_link(self) -> None:
        """Pull the cable of the client that is logged in."""
        with self._act():
            if self._slot.client is not None:
                self._slot.client.cut()

    @contextmanager
    def _act(self) -> Iterator[None]:
        with self.lock:
            # A planned act happens at its own instant, in the middle of an advance.
            if self.present_ns is not None and not self._stepping:
                self.advance(self.present_ns())
            yield
        for watcher in tuple(self.watchers):
            watcher()

    def _cut_power(self, number: int, text: str) -> None:
        self.machine.arm.halt(self._now_ns)
        self.machine.switch_motors(False)
        self._window.fail(number, text, self._now_ns)
