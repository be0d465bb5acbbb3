"""A value that is typed and takes the tip farther than the cell allows: who may, and is asked.

A calibration refuses what no nozzle change explains; a slip of the fingers, a sign or a unit,
takes the tip just as far.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, TypeVar

import click

from robolink.errors import DeclinedError
from robolink.messages import declared, tr
from robolink_cli.console.numbers import NumberInside
from robolink_cli.console.render import json_is_on
from robolink_cli.prompts.questions import asked, on_terminal

if TYPE_CHECKING:
    from robolink.model import Controller, Jump

F = TypeVar("F", bound=Callable[..., Any])


def accept_jump_options(function: F) -> F:
    """Add ``--accept-jump`` and ``--accept-turn``."""
    positive = NumberInside(min=0, min_open=True)
    options = (
        click.option(
            "--accept-jump",
            "accepted_mm",
            metavar="MM",
            type=positive,
            help=declared(
                "Accept a change up to MM this time, beyond the cell's limit; for engineers."
            ),
        ),
        click.option(
            "--accept-turn",
            "accepted_deg",
            metavar="DEG",
            type=positive,
            help=declared(
                "Accept a turn up to DEG this time, beyond the cell's limit; for engineers."
            ),
        ),
    )
    for option in reversed(options):
        function = option(function)
    return function


@contextmanager
def accepted_jump(
    controller: "Controller",
    tool: int,
    jump: "Jump",
    *,
    accepted_mm: float | None,
    accepted_deg: float | None,
) -> Iterator[None]:
    """Have a jump beyond the limits of the cell accepted, for the block, by who may accept it.

    ``--yes`` does not answer this question: it was typed before the figure was known.

    Args:
        controller: The controller, connected.
        tool: Number of the tool.
        jump: How far its tip would be taken.
        accepted_mm: The length that was accepted beforehand.
        accepted_deg: The angle that was accepted beforehand.

    Raises:
        NotAllowedError: It takes an engineer; nobody was asked.
        DeclinedError: The answer was no, or nobody could be asked.
    """
    from robolink.model import PersonRole

    guard = controller.change_guard
    allowed = guard.limits
    # Who may not is refused, not asked.
    if controller.outcomes.signature.role != PersonRole.OPERATOR and jump.exceeds(
        accepted_mm or allowed.length_mm, accepted_deg or allowed.angle_deg
    ):
        _ask(allowed.figure(tool, jump))
    with guard.accepting(tool, jump):
        yield


def _ask(figure: str) -> None:
    if json_is_on() or not on_terminal():
        raise DeclinedError(
            figure,
            remedy=tr(
                "Nothing was written. Check sign and unit. An engineer may write it on a "
                "terminal, or with --accept-jump and --accept-turn."
            ),
        )
    if not asked(tr("{figure} Write it all the same? Check sign and unit first.", figure=figure)):
        raise DeclinedError(tr("That was not y."), remedy=tr("Nothing was written."))
