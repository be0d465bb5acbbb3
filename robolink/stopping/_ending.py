"""Ends a process of this computer that has a controller and does not respond.

Only a person decides that, and only once the robot is known to stand still: until then that
process may be the only one that can stop it. A process number is given to others in time, so what
is ended is told by when it was started, and is held by its descriptor from that check on. One
that is frozen is never woken up for it: it would go on with what it was doing.
"""

import os
import select
import signal
from contextlib import suppress
from pathlib import Path
from typing import Final

from robolink.errors import BusyError
from robolink.journal import LeaseHolder, describe_holder, this_process
from robolink.messages import tr

OWN_END_S: Final = 5.0
"""Time in s in which a process that was stopped may end by itself."""

ASKED_S: Final = 10.0
"""Time in s in which a process may clean up after SIGTERM: it restores what it changed."""

KILLED_S: Final = 10.0
"""Longest wait in s for the end of a killed process."""

_FROZEN: Final = ("T", "t")


def may_be_ended(process: LeaseHolder) -> bool:
    """Whether a process is another one of this computer, and known to run.

    Args:
        process: As the lease, or the process itself, tells it.
    """
    return this_process().knows_to_run(process)


def end_process(process: LeaseHolder, *, own_end_s: float = OWN_END_S) -> None:
    """End a process that has a controller, and return when it is gone.

    Only after the robot is known to stand still, because a person said so. It first may end by
    itself, then it is asked to (SIGTERM), then killed; one that is frozen is killed at once.
    Nothing is done if it has ended already, even if its number is another process's by now.

    Args:
        process: As the lease, or the process itself, tells it.
        own_end_s: How long to wait, in s, for one that a stop has ended.

    Raises:
        BusyError: It cannot be ended from here: it belongs to another computer or user, this
            system cannot tell it from another process, or it outlives being killed.
    """
    here = this_process()
    if not here.can_tell(process) or here.pid == process.pid:
        raise _refused(process, tr("this computer cannot tell it from other processes"))
    try:
        held = os.pidfd_open(process.pid)
    except ProcessLookupError:
        return
    except (AttributeError, OSError) as error:
        raise _refused(process, str(error)) from error
    try:
        # The number may have been another process's since it was noted; from here on it is not.
        if here.proves_gone(process):
            return
        _end(process, held, own_end_s)
    finally:
        os.close(held)


def _end(process: LeaseHolder, held: int, own_end_s: float) -> None:
    folder = Path(f"/proc/{process.pid}")
    try:
        owner = folder.stat().st_uid
    except OSError:
        return  # it has just ended
    if owner != os.geteuid():
        raise _refused(process, tr("it belongs to another user"))
    if not _is_frozen(folder):
        if _gone_within(held, own_end_s):
            return
        _send(held, signal.SIGTERM)
        if _gone_within(held, ASKED_S):
            return
    _send(held, signal.SIGKILL)
    if not _gone_within(held, KILLED_S):
        raise _refused(process, tr("it did not end when it was killed"))


def _is_frozen(folder: Path) -> bool:
    try:
        fields = (folder / "stat").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return False
    return fields.rpartition(")")[2].split()[0] in _FROZEN


def _send(held: int, number: signal.Signals) -> None:
    with suppress(ProcessLookupError):  # it has ended
        signal.pidfd_send_signal(held, number)


def _gone_within(held: int, seconds: float) -> bool:
    end = select.poll()
    end.register(held, select.POLLIN)
    return bool(end.poll(seconds * 1000))


def _refused(process: LeaseHolder, why: str) -> BusyError:
    return BusyError(
        tr("{holder} was not ended: {why}.", holder=describe_holder(process), why=why),
        remedy=tr("End that program where it runs, or restart that computer."),
    )
