"""What GetStatus shows of the controller, and why it says no.

Why the simulated controller says no.

The texts are the controller's own, as GetErrMsg would give them: they travel over the wire
and are data there, so they are not translated.
"""

from enum import Enum, StrEnum, auto
from functools import lru_cache
from typing import Final

from robolink.protocols.epson_text import ErrorCode, StatusFlags

_MOST_DIGITS: Final = 9


class RefusalKind(StrEnum):
    """What went wrong; each value names the field of ``SpelNumbers`` that numbers it."""

    SYNTAX = "syntax"
    NOT_ALLOWED_HERE = "not_allowed_here"
    VALUE_OUT_OF_RANGE = "value_out_of_range"
    OUT_OF_REACH = "out_of_reach"
    MOTORS_OFF = "motors_off"
    TOOL_UNDEFINED = "tool_undefined"
    TOOL_ZERO_FIXED = "tool_zero_fixed"
    TOOL_IN_FORCE = "tool_in_force"
    LOCAL_UNDEFINED = "local_undefined"
    POINT_UNDEFINED = "point_undefined"
    ABOVE_LIMZ = "above_limz"
    ARM_UNDEFINED = "arm_undefined"
    ECP_UNDEFINED = "ecp_undefined"
    PALLET_UNDEFINED = "pallet_undefined"
    BOX_NUMBER = "box_number"
    BOX_UNDEFINED = "box_undefined"
    PLANE_NUMBER = "plane_number"
    PLANE_UNDEFINED = "plane_undefined"
    ROBOT_NUMBER = "robot_number"
    NAME_UNDEFINED = "name_undefined"
    HOME_UNDEFINED = "home_undefined"
    CALIBRATION_PULSES = "calibration_pulses"
    MOTORS_ON = "motors_on"
    NOT_RESERVED = "not_reserved"
    LATCH_UNSET = "latch_unset"
    GUARD_OPEN = "guard_open"
    EMERGENCY_STOP = "emergency_stop"
    WAIT_TIMED_OUT = "wait_timed_out"
    JOINT_FREE = "joint_free"
    JOINT_TOO_FAST = "joint_too_fast"
    OTHER_ROBOT = "other_robot"
    FINE_NOT_REACHED = "fine_not_reached"
    TORQUE_TOO_LATE = "torque_too_late"
    SPEED_TOO_LATE = "speed_too_late"
    TORQUE_HIGH_POWER = "torque_high_power"
    TORQUE_LOW_POWER = "torque_low_power"
    COLLISION_HIGH_POWER = "collision_high_power"
    COLLISION_LOW_POWER = "collision_low_power"
    FUNCTION_ONLY = "function_only"
    NOT_SIMULATED = "not_simulated"
    SUBSCRIPT = "subscript"
    TYPE_MISMATCH = "type_mismatch"
    NO_SUCH_FILE = "no_such_file"
    TASK_GONE = "task_gone"
    RETURN_WITHOUT_GOSUB = "return_without_gosub"
    NEXT_WITHOUT_FOR = "next_without_for"
    INPUT_COUNT = "input_count"
    EXCESSIVE_LOOP = "excessive_loop"
    NO_SUCH_FUNCTION = "no_such_function"
    TASK_NUMBER = "task_number"
    NO_MOVER = "no_mover"
    MOVER_ENDED = "mover_ended"
    MOTION_ABORTED = "motion_aborted"
    ABORTED_AT_REST = "aborted_at_rest"
    NOT_IN_THIS_TASK = "not_in_this_task"
    ROBOT_IN_USE = "robot_in_use"
    PREFERENCE_OFF = "preference_off"
    PORT_NOT_OPEN = "port_not_open"
    PORT_OF_OTHER_TASK = "port_of_other_task"
    PORT_IN_USE = "port_in_use"
    PORT_ADDRESS = "port_address"
    PORT_UNSET = "port_unset"
    PORT_OPEN_ALREADY = "port_open_already"
    PORT_BROKEN = "port_broken"
    PORT_TIMED_OUT = "port_timed_out"
    PORT_LINE_TOO_LONG = "port_line_too_long"
    FILE_NUMBER_IN_USE = "file_number_in_use"
    FILE_OPENING = "file_opening"
    FILE_NOT_OPEN = "file_not_open"
    FILE_OF_OTHER_TASK = "file_of_other_task"
    FILE_SEEKING = "file_seeking"
    FILE_NUMBERS_USED = "file_numbers_used"
    FILE_NOT_READABLE = "file_not_readable"
    FILE_NOT_WRITABLE = "file_not_writable"
    FILE_NOT_BINARY = "file_not_binary"
    FILE_ACCESS = "file_access"
    FILE_WRITING = "file_writing"
    FILE_READING = "file_reading"
    FILE_DRIVE = "file_drive"
    FILE_FOLDER = "file_folder"
    FILE_DENIED = "file_denied"
    POINT_FILE_LONG = "point_file_long"
    POINT_FILE_NAME = "point_file_name"
    TOOL_NUMBER = "tool_number"
    ARM_NUMBER = "arm_number"
    ARM_ZERO = "arm_zero"
    ARM_IN_FORCE = "arm_in_force"
    JOINT_NUMBER = "joint_number"
    ARCH_NUMBER = "arch_number"
    ECP_NUMBER = "ecp_number"
    ECP_ZERO = "ecp_zero"
    ECP_IN_FORCE = "ecp_in_force"
    LOCAL_NUMBER = "local_number"
    LOCAL_ZERO = "local_zero"
    PALLET_NUMBER = "pallet_number"
    RESUME_WITHOUT_ERROR = "resume_without_error"
    VIRTUAL_IO_OFF = "virtual_io_off"
    LOCK_TAKEN = "lock_taken"
    LOCK_NOT_HELD = "lock_not_held"
    FORMAT = "format"
    COUNTERS_USED = "counters_used"
    OUTPUT_TIME = "output_time"
    IO_BIT = "io_bit"
    IO_BYTE = "io_byte"
    MEMORY_BIT = "memory_bit"
    MEMORY_BYTE = "memory_byte"
    SQUARE_ROOT = "square_root"
    ARC_SINE = "arc_sine"
    ARC_COSINE = "arc_cosine"
    TEXT_LENGTH = "text_length"
    OVERFLOW = "overflow"
    UNDERFLOW = "underflow"
    DIVISION = "division"
    DECIMAL_IN = "decimal_in"
    DECIMAL_OUT = "decimal_out"
    WAIT_TIME = "wait_time"
    TASKS_FULL = "tasks_full"
    TASK_BUSY = "task_busy"
    DISTANCE = "distance"
    LABEL_UNDEFINED = "label_undefined"
    POINT_LABEL_UNDEFINED = "point_label_undefined"
    SHARED_WAIT_TIMED_OUT = "shared_wait_timed_out"
    NET_WAIT_TIMED_OUT = "net_wait_timed_out"
    VISION_SEQUENCE = "vision_sequence"
    VISION_OBJECT = "vision_object"
    VISION_NAME = "vision_name"
    VISION_UNCALIBRATED = "vision_uncalibrated"
    VISION_CALIBRATION = "vision_calibration"
    VISION_CAMERA = "vision_camera"


class SpelRefusal(Exception):
    """The controller will not do it; nothing was changed and nothing moves.

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
    """A target that the arm cannot take up."""

    def __init__(self, text: str) -> None:
        super().__init__(RefusalKind.OUT_OF_REACH, text)


class RequestRefused(Exception):
    """A request that is answered with ``!Name,code``: nothing was carried out.

    Attributes:
        code: What is answered (docs/reference/epson.md 1.6).
    """

    def __init__(self, code: int) -> None:
        super().__init__(code)
        self.code = code


def malformed() -> RequestRefused:
    """Return the refusal of a parameter that makes no sense."""
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
