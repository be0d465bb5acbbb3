"""Runs the work of a command in a thread of its own, while the main one shows it."""

import os
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Final, TypeVar

import click

from robolink.errors import RobolinkError
from robolink_cli.console.output import PLAIN, shown_by
from robolink_cli.console.render import note
from robolink_cli.prompts.current_desk import sitting_at
from robolink_cli.wizard.ending import ended_of, kept_lines
from robolink_cli.wizard.happenings import WizardCommand
from robolink_cli.wizard.state import Header, WizardState
from robolink_cli.wizard.work import Desk, Face, Work

_POOR: Final = frozenset({"", "dumb", "unknown"})
"""Values of TERM for terminals that support no control sequences."""


def face_here() -> "Face":
    """Return the face for this process's terminal: the full screen if possible.

    In a small window that one begins with lines.
    """
    if draws_whole_screens():
        from robolink_cli.wizard.faces.full import FullFace

        return FullFace()
    from robolink_cli.wizard.faces.lines import LineFace

    return LineFace()


def draws_whole_screens() -> bool:
    """Return whether terminal and person accept full screens, once there is room."""
    context = click.get_current_context(silent=True)
    plain = context is not None and bool(context.meta.get(PLAIN))
    if plain or os.environ.get("ROBOLINK_PLAIN") == "1":
        return False
    if os.name != "nt" and os.environ.get("TERM", "") in _POOR:
        return False
    try:
        if os.name == "nt":
            # On Windows prompt_toolkit calls functions of stdout's console, whatever stream it
            # draws on; with stdout in a file there is no console, and it fails.
            os.get_terminal_size(sys.stdout.fileno())
        size = os.get_terminal_size(sys.stderr.fileno())
    except (OSError, ValueError, AttributeError):
        return False
    return min(size.columns, size.lines) > 0  # an unknown size is not guessed


T = TypeVar("T")


def guided(
    header: Header,
    do: Callable[[], T],
    *,
    report: Callable[[str], tuple[str, ...]] | None = None,
    following: Callable[[], T] | None = None,
) -> T:
    """Do the work of a command, guided by a face on this process's terminal.

    Args:
        header: What stands in the first row.
        do: The work; what it asks and shows goes to the face.
        report: Writes the page about a change, by its id; returns where it is, in sentences.
            ``None`` where none is offered.
        following: The work that begins with a choice, for the next tool; ``None`` for none.

    Raises:
        BaseException: Whatever ended the work.
    """
    face, offers = face_here(), set()
    if report is not None:
        offers.add(WizardCommand.SHOW_REPORT)
    if following is not None:
        offers.add(WizardCommand.NEXT_TOOL)
    while True:
        desk, work = Desk(), Work(do)
        with sitting_at(desk), shown_by(lambda text, _beside: desk.tell(text)):  # noqa: B023 - used inside the turn
            work.start()
            state = _shown(face, desk, WizardState(header, offers=frozenset(offers)), work)
        while state.wants is WizardCommand.SHOW_REPORT and report is not None:
            state = _shown(face, desk, _reported(state, report), work)
        _leave(state, work.error)
        if state.wants is WizardCommand.NEXT_TOOL and following is not None:
            do = following
        elif state.wants is not WizardCommand.BEGIN_AGAIN:
            break
    if work.error is not None:
        raise work.error
    return work.result  # type: ignore[return-value]


def _shown(face: Face, desk: Desk, state: WizardState, work: "Work[T]") -> WizardState:
    """Show the work until it has ended, also when it cannot be shown any more.

    The work is in a thread that would end with the process in the middle of a measurement. So it
    is told that nobody answers, and awaited: tool, power and speed are restored then, and the
    controller is logged out.
    """
    try:
        return face.run(desk, state, work)
    except (EOFError, OSError):  # the window was closed, or its connection was lost
        _ends_alone(desk, work)
        return state
    except BaseException:
        _ends_alone(desk, work)
        raise


def _reported(state: WizardState, report: Callable[[str], tuple[str, ...]]) -> WizardState:
    """Return the last screen with the place of the page; or why there is none, and the offer."""
    ended = state.ended
    assert ended is not None and state.report is not None  # noqa: S101, PT018 - it was offered there
    again = replace(state, wants=None, message="")
    try:
        said = report(state.report.change)
    except (RobolinkError, OSError) as error:
        why = error.what if isinstance(error, RobolinkError) else str(error)
        return replace(again, message=why, ended=replace(ended, at_s=time.monotonic()))
    lines, kept = (*ended.lines, *said), (*ended.kept, *said)
    shown = replace(ended, lines=lines, kept=kept, at_s=time.monotonic())
    return replace(again, offers=state.offers - {WizardCommand.SHOW_REPORT}, ended=shown)


def _ends_alone(desk: Desk, work: "Work[T]") -> None:
    desk.leave()
    while not work.wait(1.0):
        pass


def _leave(state: WizardState, error: BaseException | None) -> None:
    """Print what stays when the screen is gone."""
    ended = state.ended or ended_of(state, error, 0.0)
    lines = ended.kept if ended is not None else (*kept_lines(state, error), *_unread(state, error))
    if lines:
        note("\n".join(lines))


def _unread(state: WizardState, error: BaseException | None) -> tuple[str, ...]:
    return state.fresh if error is None else ()
