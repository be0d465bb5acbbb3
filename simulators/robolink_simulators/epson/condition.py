"""What GetStatus shows of the controller, and why it refuses.

Why the simulated controller says no.

The texts are the controller's own, as GetErrMsg would give them: they travel over the wire
and are data there, so they are not translated.
"""

from dataclasses import fields
from enum import Enum, StrEnum, auto
from functools import lru_cache
from typing import Final

from robolink.protocols.epson_text import ErrorCode, StatusFlags

_MOST_DIGITS: Final = 9


class RefusalKind(Enum):
    """The kind of a refusal, and its number unless an option changes it.

    Numbers with a section stand in the language reference or in the table of errors; the others
    do not [U], and any number would do: each reason has one of its own.
    """

    SYNTAX = 2100
    NOT_ALLOWED_HERE = 2353  # docs/reference/spel.md 10
    FUNCTION_ONLY = 2120
    NAME_UNDEFINED = 2121
    NOT_SIMULATED = 2199
    WAIT_TIMED_OUT = 2280  # docs/reference/spel.md 4.6
    VALUE_OUT_OF_RANGE = 4002  # docs/reference/spel.md 10, for AvoidSingularity
    OUT_OF_REACH = 4001
    MOTORS_OFF = 4023
    EMERGENCY_STOP = 4025
    GUARD_OPEN = 4026
    JOINT_FREE = 4027
    OTHER_ROBOT = 4028
    JOINT_TOO_FAST = 4242  # docs/reference/spel.md 10
    FINE_NOT_REACHED = 4024  # docs/reference/spel.md 10, as the six that follow
    TORQUE_TOO_LATE = 4030
    SPEED_TOO_LATE = 4088
    TORQUE_HIGH_POWER = 5040
    TORQUE_LOW_POWER = 5041
    COLLISION_HIGH_POWER = 5057
    COLLISION_LOW_POWER = 5058
    ARM_UNDEFINED = 2227  # docs/reference/spel.md 10
    ECP_UNDEFINED = 2232  # docs/reference/spel.md 10
    PALLET_UNDEFINED = 2238  # docs/reference/spel.md 10
    BOX_NUMBER = 2216  # docs/reference/spel.md 10
    BOX_UNDEFINED = 2217  # docs/reference/spel.md 10
    PLANE_NUMBER = 2218  # docs/reference/spel.md 10
    PLANE_UNDEFINED = 2219  # docs/reference/spel.md 10
    ROBOT_NUMBER = 2262  # docs/reference/spel.md 10
    TOOL_UNDEFINED = 2230  # docs/reference/spel.md 10
    TOOL_ZERO_FIXED = 2207  # docs/reference/spel.md 10
    TOOL_IN_FORCE = 2206  # docs/reference/spel.md 10
    LOCAL_UNDEFINED = 2222  # docs/reference/spel.md 10
    POINT_UNDEFINED = 7007  # docs/reference/spel.md 10, sample handler
    ABOVE_LIMZ = 4005  # docs/reference/spel.md 10
    SUBSCRIPT = 2240  # docs/reference/spel.md 10
    TYPE_MISMATCH = 2130
    ABORTED = 2995
    LOGGED_OUT_IN_TASK = 2996
    HOME_UNDEFINED = 2228  # docs/reference/spel.md 10
    CALIBRATION_PULSES = 2197
    MOTORS_ON = 4029
    NOT_RESERVED = 2198
    LATCH_UNSET = 2196
    SERIOUS = 9001
    NO_SUCH_FILE = 7213  # docs/reference/spel.md 10, path not found
    TASK_GONE = 2261  # docs/reference/spel.md 10
    RETURN_WITHOUT_GOSUB = 2383  # docs/reference/spel.md 10
    NEXT_WITHOUT_FOR = 2381  # docs/reference/spel.md 10
    INPUT_COUNT = 2505  # docs/reference/spel.md 10
    EXCESSIVE_LOOP = 2556  # docs/reference/spel.md 10
    NO_SUCH_FUNCTION = 2122
    TASK_NUMBER = 2260  # docs/reference/spel.md 17
    NO_MOVER = 2191  # docs/reference/spel.md 10
    MOVER_ENDED = 2192
    ABORTED_AT_REST = 2998  # docs/reference/spel.md 10
    MOTION_ABORTED = 2999  # docs/reference/spel.md 10
    NOT_IN_THIS_TASK = 2295  # docs/reference/spel.md 10
    ROBOT_IN_USE = 2200  # docs/reference/spel.md 10
    PREFERENCE_OFF = 2194
    PORT_NOT_OPEN = 2909
    PORT_OF_OTHER_TASK = 2912
    PORT_IN_USE = 2900
    PORT_ADDRESS = 2904
    PORT_UNSET = 2906
    PORT_OPEN_ALREADY = 2908
    PORT_BROKEN = 2902  # docs/reference/spel.md 17
    PORT_TIMED_OUT = 2910
    PORT_LINE_TOO_LONG = 2915
    FILE_NUMBER_IN_USE = 2440  # docs/reference/spel.md 10, as those that follow
    FILE_OPENING = 2441
    FILE_NOT_OPEN = 2442
    FILE_OF_OTHER_TASK = 2443
    FILE_SEEKING = 2445
    FILE_NUMBERS_USED = 2446
    FILE_NOT_READABLE = 2447
    FILE_NOT_WRITABLE = 2448
    FILE_NOT_BINARY = 2449
    FILE_ACCESS = 2450
    FILE_WRITING = 2451
    FILE_READING = 2452
    FILE_DRIVE = 2455
    FILE_FOLDER = 2456
    FILE_DENIED = 7203  # docs/reference/spel.md 10, access denied
    POINT_FILE_LONG = 2520
    POINT_FILE_NAME = 2522
    # For those below, see docs/reference/spel.md 10.
    TOOL_NUMBER = 2229
    ARM_NUMBER = 2226
    ARM_ZERO = 2205
    ARM_IN_FORCE = 2204
    JOINT_NUMBER = 2265
    ARCH_NUMBER = 2271
    ECP_NUMBER = 2231
    ECP_ZERO = 2208
    ECP_IN_FORCE = 2209
    LOCAL_NUMBER = 2223
    LOCAL_ZERO = 2203
    PALLET_NUMBER = 2237
    RESUME_WITHOUT_ERROR = 2386
    VIRTUAL_IO_OFF = 2350
    LOCK_TAKEN = 2512
    LOCK_NOT_HELD = 2511
    FORMAT = 2519
    COUNTERS_USED = 2507
    OUTPUT_TIME = 2343
    IO_BIT = 2344
    IO_BYTE = 2345
    MEMORY_BIT = 2347
    MEMORY_BYTE = 2348
    SQUARE_ROOT = 2276
    ARC_SINE = 2274
    ARC_COSINE = 2275
    TEXT_LENGTH = 2370
    OVERFLOW = 2243
    UNDERFLOW = 2244
    DIVISION = 2242
    DECIMAL_IN = 2340
    DECIMAL_OUT = 2341
    WAIT_TIME = 2266
    TASKS_FULL = 2502
    TASK_BUSY = 2503
    DISTANCE = 2270
    LABEL_UNDEFINED = 2510
    POINT_LABEL_UNDEFINED = 2513
    SHARED_WAIT_TIMED_OUT = 2281
    NET_WAIT_TIMED_OUT = 2282
    VISION_SEQUENCE = 2543  # docs/reference/spel.md 10
    VISION_OBJECT = 2544  # docs/reference/spel.md 10
    VISION_NAME = 7803
    VISION_UNCALIBRATED = 7804
    VISION_CALIBRATION = 2545  # docs/reference/spel.md 10
    VISION_CAMERA = 7806

    @property
    def option(self) -> str:
        """The field of ``SpelNumbers`` that changes its number."""
        return self.name.lower()


class SpelRefusal(Exception):
    """The controller refuses; nothing was changed and nothing moves.

    Attributes:
        kind: What went wrong.
        text: The controller's sentence.
    """

    def __init__(self, kind: RefusalKind, text: str) -> None:
        super().__init__(text)
        self.kind = kind
        self.text = text


class RaisedError(SpelRefusal):
    """An error that a program raises by its number: ``Error 8001``.

    Attributes:
        number: Which.
    """

    def __init__(self, number: int, text: str = "") -> None:
        super().__init__(RefusalKind.SYNTAX, text or f"Error {number}")
        self.number = number


class OutOfReach(SpelRefusal):
    """A target that the arm cannot reach."""

    def __init__(self, text: str) -> None:
        super().__init__(RefusalKind.OUT_OF_REACH, text)


class RequestRefused(Exception):
    """A request answered with ``!Name,code``: nothing was carried out.

    Attributes:
        code: What is answered (docs/reference/epson.md 1.6).
    """

    def __init__(self, code: int) -> None:
        super().__init__(code)
        self.code = code


def malformed() -> RequestRefused:
    """Return the refusal of an invalid parameter."""
    return RequestRefused(ErrorCode.MALFORMED)


def number(text: str, most: int | None = None) -> int:
    """Return an unsigned parameter as a number.

    Raises:
        RequestRefused: It is larger than ``most``, or than any number that the controller knows.
    """
    if len(text) > _MOST_DIGITS or not text.isdecimal():
        raise malformed()
    value = int(text)
    if most is not None and value > most:
        raise malformed()
    return value


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
    """The state that decides which requests a controller serves (docs/reference/epson.md 1.4).

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
        """Release the button; the stop remains active until Reset."""
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
        """Show a warning; tasks continue. A present error is kept."""
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
        """Switch off and on: only what is outside the controller stays as it is."""
        self._estop_latched = self.estop_pressed
        self._error = self._serious = self._warning = False
        self.code = self.program_error = 0
        self.failure = None
        self.task = Task.NONE

    def flags(self, *, executing: bool = False) -> StatusFlags:
        """Return the flags; ``executing`` shows an Execute as a running task."""
        return self._shared(executing=executing)[0]

    def names_on(self) -> frozenset[str]:
        """Return the names of the flags that are on while no Execute runs."""
        return self._shared(executing=False)[1]

    def _shared(self, *, executing: bool) -> tuple[StatusFlags, frozenset[str]]:
        mode, task = self.mode, self.task
        return _shared_flags(
            mode is _TEST,
            mode is _TEACH,
            mode is _AUTO and not self.monitoring_only,
            self._warning,
            self._serious,
            self.guard_open,
            self._estop_latched,
            self._error,
            task is _PAUSED,
            task is _RUNNING or executing,
            task is _NONE and not executing,
        )


# Each request asks for all of them, and before Python 3.12 a member of an Enum is found slowly.
_AUTO, _TEACH, _TEST = Mode
_NONE, _RUNNING, _PAUSED = Task


@lru_cache(maxsize=512)
def _shared_flags(*in_order: bool) -> tuple[StatusFlags, frozenset[str]]:
    """Return flags in the order of their class, and the names of those that are on."""
    flags = StatusFlags(*in_order)
    return flags, frozenset(one.name for one in fields(flags) if getattr(flags, one.name))
