"""Runs the work of a command in a thread of its own, while a face shows it in the main one."""

from collections.abc import Callable
from typing import TypeVar

from robolink_cli.console.output import shown_by
from robolink_cli.console.render import note
from robolink_cli.prompts.present import sitting_at
from robolink_cli.wizard.desk import Desk
from robolink_cli.wizard.screens.ending import ended_of, kept_lines
from robolink_cli.wizard.state import Header, WizardState
from robolink_cli.wizard.work import Face, Work

T = TypeVar("T")


def guided(header: Header, do: Callable[[], T]) -> T:
    """Do the work of a command, guided by a face on this process's terminal.

    Args:
        header: What stands in the first row.
        do: The work; what it asks and shows goes to the face.

    Raises:
        BaseException: Whatever ended the work.
    """
    from robolink_cli.wizard.faces.choice import face_here

    face = face_here()
    while True:
        desk, work = Desk(), Work(do)
        with sitting_at(desk), shown_by(lambda text, _beside: desk.tell(text)):  # noqa: B023 - used inside the turn
            work.start()
            state = _shown(face, desk, WizardState(header), work)
        _leave(state, work.error)
        if not state.begins_again:
            break
    if work.error is not None:
        raise work.error
    return work.result  # type: ignore[return-value]


def _shown(face: Face, desk: Desk, state: WizardState, work: "Work[T]") -> WizardState:
    """Show the work until it has ended, also where that cannot be shown any more.

    The work is in a thread that would end with the process in the middle of a measurement. So it
    is told that nobody answers, and awaited: tool, power and speed are put back then, and the
    controller is logged out.
    """
    try:
        return face.run(desk, state, work)
    except (EOFError, OSError):  # the window was closed, or the line to it is gone
        _ends_alone(desk, work)
        return state
    except BaseException:
        _ends_alone(desk, work)
        raise


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
