"""The states of an axis group and what programs read of it."""

from dataclasses import dataclass
from enum import IntEnum

from robolink_simulators.softmotion.kinematics.kinematics import AxisValues, Configuration
from robolink_simulators.softmotion.smc_errors import SmcError


class SmcGroupState(IntEnum):
    """``SMC_AXIS_GROUP_STATE``; the numbers are a field report.

    Source: docs/reference/softmotion.md 2.1.
    """

    DISABLED = 0
    STANDBY = 1
    MOVING = 2
    HOMING = 3
    STOPPING = 4
    ERROR_STOP = 5


class ReadToolMode(IntEnum):
    """Which tool SMC_GroupReadTool gives; numbers of opcode 30002 (docs/reference/mailbox.md)."""

    SET = 0
    ACTIVE_MOVEMENT = 1
    LAST_COMMANDED = 2


@dataclass(frozen=True, slots=True)
class GroupStatus:
    """What MC_GroupReadStatus and MC_GroupReadError give, and the drives' power.

    Attributes:
        state: State of the group.
        active_movement: Number of the active movement, 0 for none.
        unfinished: Movements accepted and not ended, interrupted ones among them.
        interrupted_movement: Number of the movement that can be continued, 0 for none.
        jogging: Whether a jog is under way.
        powered: Whether every drive has power.
        error: The group error.
    """

    state: SmcGroupState
    active_movement: int
    unfinished: int
    interrupted_movement: int
    jogging: bool
    powered: bool
    error: SmcError | None


@dataclass(frozen=True, slots=True)
class ActualPosition:
    """What MC_GroupReadActualPosition gives.

    Attributes:
        values: Axis values in ACS, else X, Y, Z in mm and A, B, C in degrees.
        configuration: Of a Cartesian position; ``None`` in ACS (documented).
    """

    values: AxisValues
    configuration: Configuration | None
