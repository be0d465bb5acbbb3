"""The state of an axis group in the words that all controllers share, and what it forbids."""

from typing import Final

from robolink.controllers.softmotion.heartbeat import MOST_LOOK_S
from robolink.errors import ConfigError, NotReadyError, NotReadyReason
from robolink.messages import tr
from robolink.model import ControllerStatus
from robolink.protocols.mailbox import Bits, GroupState, Response, error_meaning

_MOVING = frozenset({GroupState.MOVING, GroupState.HOMING})


def is_moving(now: Response) -> bool:
    """Whether the group moves, whatever moves it; an interrupted movement does not move."""
    return now.group_state in _MOVING or bool(now.bits & Bits.JOGGING)


_STAYED: Final = 0.05
"""Largest change of a stopped axis within a tenth of a second, in mm or degrees: drives hold a
position within microns and millidegrees, and robolink moves no slower than 1 mm/s."""

_UM_PER_MM: Final = 1000.0


def has_stayed(before: Response, now: Response) -> bool:
    """Whether every axis is where it was; a PLC whose program does not run shows nothing.

    Which axes turn is not known here, so none may change by more than the limit in degrees, nor by
    more than that in mm: where the PLC counts metres, 0.05 of its units are a fast movement.
    """
    most = min(_STAYED, _STAYED * _UM_PER_MM / now.unit_um)
    return before.plc_heartbeat != now.plc_heartbeat and all(
        abs(a - b) < most for a, b in zip(before.axes, now.axes, strict=True)
    )


def status_of(now: Response) -> ControllerStatus:
    """Translate a snapshot (docs/reference/mailbox.md).

    ``remote`` is the machine's permit, ``paused`` an interrupted movement or a held stop,
    ``ready`` a group at rest that could move: enabled, its drives with power. ``code`` is
    robolink's error class, given in the error state only: elsewhere that word is about the last
    command.
    """
    fault = now.group_state == GroupState.ERRORSTOP
    powered = bool(now.bits & Bits.POWERED)
    return ControllerStatus(
        remote=bool(now.bits & Bits.PERMITTED),
        ready=now.group_state == GroupState.STANDBY and powered and not is_moving(now),
        disabled=now.group_state == GroupState.DISABLED,
        unpowered=not powered,
        running=is_moving(now),
        paused=bool(now.bits & Bits.INTERRUPTED) or now.group_state == GroupState.STOPPING,
        fault=fault,
        code=now.error_class if fault else 0,
    )


def condition_of(now: Response) -> dict[str, object]:
    """Return what a snapshot shows beyond the flags, plain JSON."""
    bits = now.bits
    return {
        "text": error_meaning(now.error_class) if status_of(now).code else "",
        "selected_tool": now.tool_slot,
        "tool_known": is_tool_known(now),
        "held_by_a_stop": now.group_state == GroupState.STOPPING,
        "motors_on": now.group_state != GroupState.DISABLED,
        "powered": bool(bits & Bits.POWERED),
        "owned": bool(bits & Bits.OWNED),
        "permitted": bool(bits & Bits.PERMITTED),
        "simulated": bool(bits & Bits.SIMULATED),
        "unfinished_movements": now.queue_length,
    }


def require_permit(now: Response) -> None:
    """Refuse a change while the machine does not permit it.

    Raises:
        NotReadyError: The permit (xPermit) is missing.
    """
    if not now.bits & Bits.PERMITTED:
        raise NotReadyError(
            tr("The machine does not permit it now."),
            reason=NotReadyReason.NOT_REMOTE,
            remedy=tr("Bring the machine to its service state (xPermit)."),
        )


def require_beats(whole_look_s: float) -> None:
    """Refuse what must be kept going on a line that is too slow for it.

    Source: docs/reference/mailbox.md.

    Args:
        whole_look_s: How long a look at the response block and a beat take on the line.

    Raises:
        ConfigError: No beat would arrive while the block is read.
    """
    if whole_look_s > MOST_LOOK_S:
        raise ConfigError(
            tr(
                "This line is too slow to move: one reading takes {look:.2f} s, and the PLC "
                "stops after 0.5 s.",
                look=whole_look_s,
            ),
            remedy=tr(
                "Nothing was sent. Set baud to 9600 or more at both ends, or use Modbus TCP."
            ),
        )


def require_still(now: Response) -> None:
    """Refuse what may not happen while the group moves (docs/reference/faults.md F42).

    Raises:
        NotReadyError: It moves, or an interrupted movement waits to go on.
    """
    if is_moving(now):
        raise NotReadyError(
            tr("The axis group is moving."),
            reason=NotReadyReason.RUNNING,
            remedy=tr("Wait until the movement has ended, or stop it."),
        )
    if now.bits & Bits.INTERRUPTED:
        raise NotReadyError(
            tr("An interrupted movement is waiting to continue."),
            reason=NotReadyReason.PAUSED,
            remedy=tr("Let it finish, or stop it."),
        )


def is_tool_known(now: Response) -> bool:
    """Whether the axis group uses the tool that the mailbox set last."""
    return bool(now.bits & Bits.TOOL_KNOWN)


def require_tool_known(now: Response) -> None:
    """Refuse a movement whose tip the mailbox does not know (docs/reference/faults.md F44).

    Raises:
        NotReadyError: The machine's own program has set another tool than the selected slot's.
    """
    if not is_tool_known(now):
        raise NotReadyError(
            tr(
                "Slot {slot} is selected, but the machine has given the axis group another tool.",
                slot=now.tool_slot,
            ),
            reason=NotReadyReason.WRONG_TOOL,
            remedy=tr(
                "Nothing moved. Select tool {slot} again, or find what sets the group's tool.",
                slot=now.tool_slot,
            ),
        )


def require_enabled(now: Response) -> None:
    """Refuse what an axis group in this state would refuse.

    Source: docs/reference/softmotion.md 1.1, 2.2.

    Raises:
        NotReadyError: It is in its error state, disabled, or held by a stop.
    """
    found = _obstacle(now)
    if found is not None:
        reason, what, remedy = found
        raise NotReadyError(
            what,
            reason=reason,
            code=status_of(now).code,
            remedy=remedy,
        )


def _obstacle(now: Response) -> tuple[NotReadyReason, str, str] | None:
    if now.group_state == GroupState.ERRORSTOP:
        return (
            NotReadyReason.FAULT,
            tr("The axis group is in its error state."),
            tr("Remove the cause, then run 'robolink robot reset'."),
        )
    if now.group_state == GroupState.STOPPING:
        return (
            NotReadyReason.PAUSED,
            tr("The axis group is held by a stop."),
            tr("When the cell is clear, run 'robolink robot release'."),
        )
    if now.group_state == GroupState.DISABLED:
        return (
            NotReadyReason.MOTORS_OFF,
            tr("The axis group is disabled."),
            tr("Run 'robolink robot motors on' when the cell is clear."),
        )
    return None


def require_power(now: Response) -> None:
    """Refuse a movement while a drive has no power.

    Raises:
        NotReadyError: It has none. Enabling the group does not switch it on
            (docs/reference/softmotion.md 2.2).
    """
    if not now.bits & Bits.POWERED:
        raise NotReadyError(
            tr("The drives of the axis group have no power."),
            reason=NotReadyReason.MOTORS_OFF,
            remedy=tr("The PLC's program switches them on (MC_Power)."),
        )
