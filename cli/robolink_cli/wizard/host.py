"""Runs the work of a command in a thread of its own, while a face shows it in the main one."""

from collections.abc import Callable
from typing import TypeVar

from robolink_cli.console.output import shown_by
from robolink_cli.console.render import note
from robolink_cli.prompts.present import sitting_at
from robolink_cli.wizard.desk import Desk
from robolink_cli.wizard.screens.ending import done_lines, stopped_lines
from robolink_cli.wizard.state import Header, WizardState
from robolink_cli.wizard.work import Work

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

    desk, work, state = Desk(), Work(do), WizardState(header)
    face = face_here()
    with sitting_at(desk), shown_by(lambda text, _beside: desk.tell(text)):
        work.start()
        state = face.run(desk, state, work)
    if work.error is not None:
        if state.subject is not None:  # else nothing was begun that could stop
            _leave(stopped_lines(state))
        raise work.error
    if state.report is not None:
        _leave(done_lines(state, state.report))
    elif state.fresh:
        _leave(list(state.fresh))
    return work.result  # type: ignore[return-value]


def _leave(lines: list[str]) -> None:
    """Print what stays when the screen is gone."""
    note("\n".join(lines))
