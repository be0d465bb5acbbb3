"""SoftMotion behaviours that no document specifies or that differ by version, as options.

Evidence marks as in docs/reference/softmotion.md: [D] vendor documentation, [F] field report,
[I] inferred, [U] unverified.
"""

from dataclasses import dataclass
from typing import Literal

from robolink_simulators.softmotion.smc_errors import ErrorKind, SmcError


@dataclass(frozen=True, slots=True)
class SmcNumbers:
    """Numbers of ``SMC_ERROR``; 0 where none could be read [U].

    Source: docs/reference/softmotion.md 1.4.
    """

    wrong_state: int = 11000  # [F]
    nothing_to_reset: int = 120  # [F]
    no_such_movement: int = 0
    not_at_continue_position: int = 0
    tool_incompatible: int = 0
    no_orientation_image: int = 0
    axes_mismatch: int = 0
    unreachable: int = 0
    axis_limit: int = 10  # [D] software limit exceeded
    configuration: int = 0
    no_edge: int = 0
    parameter: int = 0
    dynamics: int = 0
    no_power: int = 14  # [D] drive has no power
    axis_error: int = 2  # [D]
    interrupted_by_single_axis: int = 0
    pcs_still_in_use: int = 0
    blending_not_supported: int = 0
    outside_motion_task: int = 12108  # [F]

    def error(self, kind: ErrorKind, text: str = "") -> SmcError:
        """Return the error with its number."""
        number: int = getattr(self, kind.value)
        return SmcError(kind, number, text)


@dataclass(frozen=True, slots=True)
class GroupOptions:
    """The behaviours of one axis group.

    Attributes:
        cycle_us: Period of the motion task, in microseconds [project setting].
        axes_follow_group: Whether the axes go to standstill when the group comes to rest
            [D, current]; an older release leaves them synchronized [D, Machine Expert V1.2].
        queue_on_error: How queued movements end on a group error: the concept page says
            aborted, another page says error [D, contradicting].
        movement_while_stopping: What a movement or jog gets while a stop is held [I]; the
            document has it fail or abort.
        disable_from: Where MC_GroupDisable is accepted: in Standby only [I], or in any state
            but Disabled [U].
        set_tool_while_stopping: Whether SMC_GroupSetTool is accepted while a stop is held [U].
        last_commanded_tool: Whether the tool of the last commanded movement can still be read
            when no movement is unfinished [U].
        program_task: Where the program runs that calls the movement blocks [project]: outside of
            the motion task they end in error 12108 [F].
        coordinate_transform_in_use: What MC_SetCoordinateTransform does to a PCS in which an
            unfinished movement or a jog counts [U]: SMC_AXIS_GROUP_PCS_STILL_IN_USE stands on
            the pages of jogging and of dynamic coordinate systems.
        latch: Where a touch-probe latch takes the position [ours]: at the ``cycle`` in which
            the input was seen, as a program does, or at the ``edge``, as a drive does.
        numbers: Error numbers in use.
    """

    cycle_us: int = 4000
    axes_follow_group: bool = True
    queue_on_error: Literal["aborted", "error"] = "aborted"
    movement_while_stopping: Literal["error", "aborted"] = "error"
    disable_from: Literal["standby", "any"] = "standby"
    set_tool_while_stopping: bool = True
    last_commanded_tool: Literal["kept", "unfinished"] = "kept"
    program_task: Literal["motion", "other"] = "motion"
    coordinate_transform_in_use: Literal["refused", "accepted"] = "refused"
    latch: Literal["cycle", "edge"] = "cycle"
    numbers: SmcNumbers = SmcNumbers()
