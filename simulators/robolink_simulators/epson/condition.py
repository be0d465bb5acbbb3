"""What GetStatus shows: mode selector, emergency stop, guard, errors and the task."""

from enum import Enum, StrEnum, auto
from functools import lru_cache

from robolink.protocols.epson_text import StatusFlags


class Mode(StrEnum):
    """Position of the mode selector."""

    AUTO = "auto"
    TEACH = "teach"
    TEST = "test"


class Task(Enum):
    """What the production program is doing."""

    NONE = auto()
    RUNNING = auto()
    PAUSED = auto()


class Condition:
    """The state that decides what a controller serves (docs/reference/epson.md 1.4).

    An emergency stop stays in force until it is released and then Reset
    (docs/reference/epson.md 1.7). Ready means that start-up is over and no task executes; it stays
    on in an error, since Reset needs it (inferred from the table of docs/reference/epson.md 1.2).

    Attributes:
        mode: Position of the mode selector.
        monitoring_only: Another device controls the cell, so Auto stays off (inferred).
        estop_pressed: Whether the button is in.
        guard_open: Whether the safety door is open.
        task: What the production program is doing.
        code: Error or warning number, 0 for none.
        program_error: The last error that ended a running program, 0 for none.
        failure: Its number and where it happened, for GetErrMsg.
    """

    def __init__(self, *, monitoring_only: bool) -> None:
        self.mode = Mode.AUTO
        self.monitoring_only = monitoring_only
        self.estop_pressed = False
        self.guard_open = False
        self.task = Task.NONE
        self.code = 0
        self.program_error = 0
        self.failure: tuple[int, str] | None = None
        self._estop_latched = False
        self._error = False
        self._serious = False
        self._warning = False

    @property
    def error(self) -> bool:
        """Whether the controller is in its error state."""
        return self._error

    @property
    def serious(self) -> bool:
        """Whether only a restart helps."""
        return self._serious

    def press_estop(self) -> None:
        """Press the emergency stop; the production task ends."""
        self.estop_pressed = self._estop_latched = True
        self.task = Task.NONE

    def release_estop(self) -> None:
        """Release the button; the stop stays in force until Reset."""
        self.estop_pressed = False

    def open_guard(self) -> None:
        """Open the safety door; a running task pauses."""
        self.guard_open = True
        if self.task is Task.RUNNING:
            self.task = Task.PAUSED

    def raise_error(self, number: int, *, serious: bool = False) -> None:
        """Go into the error state; the production task ends (assumed)."""
        if self.task is Task.RUNNING:
            self.program_error = number % 10_000
        self._error = True
        self._serious = self._serious or serious
        self._warning = False
        self.code = number % 10_000
        self.task = Task.NONE

    def raise_warning(self, number: int) -> None:
        """Show a warning; tasks go on. An error that stands is kept."""
        if not self._error:
            self._warning = True
            self.code = number % 10_000

    def reset(self) -> None:
        """Clear error, warning and a released emergency stop.

        What Reset does while the button is still pressed is not stated; assumed: nothing.
        """
        if self.estop_pressed:
            return
        self._estop_latched = self._error = self._warning = False
        self.code = 0
        self.failure = None

    def reset_error(self) -> None:
        """Clear an error that can be cleared; an emergency stop stays (Reset Error)."""
        if not self._serious:
            self._error = self._warning = False
            self.code = 0
            self.failure = None

    def restart(self) -> None:
        """Switch off and on: only what stands outside the controller stays as it is."""
        self._estop_latched = self.estop_pressed
        self._error = self._serious = self._warning = False
        self.code = self.program_error = 0
        self.failure = None
        self.task = Task.NONE

    def flags(self, *, executing: bool = False) -> StatusFlags:
        """Return the flags; ``executing`` makes an Execute show as a running task."""
        return _shared_flags(
            self.mode is Mode.TEST,
            self.mode is Mode.TEACH,
            self.mode is Mode.AUTO and not self.monitoring_only,
            self._warning,
            self._serious,
            self.guard_open,
            self._estop_latched,
            self._error,
            self.task is Task.PAUSED,
            self.task is Task.RUNNING or executing,
            self.task is Task.NONE and not executing,
        )


@lru_cache(maxsize=512)
def _shared_flags(*in_order: bool) -> StatusFlags:
    """Return flags in the order of their class; they are asked for in every exchange."""
    return StatusFlags(*in_order)
