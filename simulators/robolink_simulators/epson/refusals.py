"""Why the simulated controller says no.

The texts are the controller's own, as GetErrMsg would give them: they travel over the wire
and are data there, so they are not translated.
"""

from enum import StrEnum
from typing import Final

from robolink.protocols.epson_text import ErrorCode

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
