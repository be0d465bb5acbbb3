"""Runs the work of a command in a thread of its own, while the main one shows it."""

import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any, Final, TypeVar

import click

from robolink.errors import RobolinkError
from robolink_cli.console.output import PLAIN, shown_by
from robolink_cli.console.person import Person, person_at
from robolink_cli.console.render import note
from robolink_cli.prompts.current_desk import current_desk, sitting_at
from robolink_cli.wizard.ending import ended_of, kept_lines
from robolink_cli.wizard.happenings import OffersAtTheEnd, WizardCommand
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


@dataclass(slots=True)
class _Offers:
    """What follows on the last screen, and the command in which it is done.

    Attributes:
        report: Writes the page about a change, by its id; ``None`` where none is offered.
        following: The work for the next tool; ``None`` for none.
        context: Of the command.
    """

    report: Callable[[str], tuple[str, ...]] | None = None
    following: Callable[[], Any] | None = None
    context: click.Context | None = None

    def named(self) -> frozenset[WizardCommand]:
        """Return what is offered."""
        offers = set()
        if self.report is not None:
            offers.add(WizardCommand.SHOW_REPORT)
        if self.following is not None:
            offers.add(WizardCommand.NEXT_TOOL)
        return frozenset(offers)


@dataclass(slots=True)
class _Wire:
    """The wire at which the person of this process is.

    Attributes:
        face: Shows the command there.
        kept: What stays of it when the last screen is gone.
        offers: Of the job that is under way.
    """

    face: Face
    kept: list[str] = field(default_factory=list)
    offers: _Offers = field(default_factory=_Offers)


_wire: _Wire | None = None


@contextmanager
def shown_on(face: Face) -> Iterator[list[str]]:
    """Show every command of this process on a face at a wire, for the block.

    Yields:
        What stays of it, a sentence each.
    """
    global _wire  # noqa: PLW0603 - a process has one person
    before, _wire = _wire, _Wire(face)
    try:
        with person_at(Person.WIRE):
            yield _wire.kept
    finally:
        _wire = before


def whole_command(header: Header, command: Callable[[], T]) -> T:
    """Carry out a command line; at a wire, whatever it asks and shows goes there.

    Args:
        header: The first row, until the command knows better.
        command: The command line; it may be carried out again from its last screen.

    Raises:
        BaseException: Whatever ended it.
    """
    if _wire is None:
        return command()
    _wire.offers = _Offers()
    state, work = _turns(_wire.face, header, command, _wire.offers)
    _wire.kept += _left_of(state, work.error)
    return _result(work)


def guided(
    header: Header,
    do: Callable[[], T],
    *,
    report: Callable[[str], tuple[str, ...]] | None = None,
    following: Callable[[], T] | None = None,
) -> T:
    """Do the work of a command, guided by a face on this process's terminal, or at the wire.

    Args:
        header: What stands in the first row.
        do: The work; what it asks and shows goes to the face.
        report: Writes the page about a change, by its id; returns where it is, in sentences.
            ``None`` where none is offered.
        following: The work that begins with a choice, for the next tool; ``None`` for none.

    Raises:
        BaseException: Whatever ended the work.
    """
    offers = _Offers(report, following, click.get_current_context(silent=True))
    desk = current_desk()
    if _wire is not None and desk is not None:
        # The whole command is shown there already.
        _wire.offers.report, _wire.offers.following = report, following
        _wire.offers.context = offers.context
        desk.regard(header)
        desk.regard(OffersAtTheEnd(offers.named()))
        return do()
    state, work = _turns(face_here(), header, do, offers)
    if lines := _left_of(state, work.error):
        note("\n".join(lines))
    return _result(work)


def _turns(
    face: Face, header: Header, do: Callable[[], T], offers: _Offers
) -> "tuple[WizardState, Work[T]]":
    """Show the work, and what follows from its last screen, until a person leaves it."""
    context, number = None, 0
    while True:
        desk, work = Desk(after=number), Work(do, context)
        state = WizardState(header, offers=offers.named(), asked=number)
        with sitting_at(desk), shown_by(lambda text, _beside: desk.tell(text)):  # noqa: B023 - used inside the turn
            work.start()
            state = _shown(face, desk, state, work)
        while state.wants is WizardCommand.SHOW_REPORT and offers.report is not None:
            state = _shown(face, desk, _reported(state, offers.report), work)
        number = state.screen_number
        if state.wants is WizardCommand.NEXT_TOOL and offers.following is not None:
            do, context = offers.following, offers.context
        elif state.wants is not WizardCommand.BEGIN_AGAIN:
            return state, work
        if lines := _left_of(state, work.error):
            note("\n".join(lines))


def _result(work: "Work[T]") -> T:
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


def _left_of(state: WizardState, error: BaseException | None) -> tuple[str, ...]:
    """Return what stays when the screen is gone."""
    ended = state.ended or ended_of(state, error, 0.0)
    if ended is not None:
        return ended.kept
    return (*kept_lines(state, error), *_unread(state, error))


def _unread(state: WizardState, error: BaseException | None) -> tuple[str, ...]:
    return state.fresh if error is None else ()
