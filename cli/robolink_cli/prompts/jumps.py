"""A value that is typed and takes the tip farther than the cell allows: who may, and is asked.

A calibration refuses what no nozzle change explains; a slip of the fingers, a sign or a unit,
takes the tip just as far.
"""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final, NamedTuple, TypeVar

import click

from robolink.errors import DeclinedError
from robolink.messages import declared, joined, tr
from robolink_cli.console.numbers import NumberInside
from robolink_cli.console.render import json_is_on
from robolink_cli.prompts.questions import asked, on_terminal

if TYPE_CHECKING:
    from robolink.config import Cell
    from robolink.model import Controller
    from robolink.transaction import Jump

F = TypeVar("F", bound=Callable[..., Any])

USUAL_CHANGE_MM: Final = 2.0
"""Where a cell names no limit of its own: more than a change of nozzles explains."""


class Allowed(NamedTuple):
    """How far a tip may be taken without an engineer.

    Attributes:
        length_mm: Largest change of its place, ``None`` where nothing is said.
        angle_deg: Largest change of its orientation, ``None`` where nothing is said.
    """

    length_mm: float | None = None
    angle_deg: float | None = None


def allowed_by(cell: "Cell | None") -> Allowed:
    """Return what a cell allows; a URL alone says nothing."""
    if cell is None:
        return Allowed()
    return Allowed(jump_limit_mm(cell), cell.settings.max_change_deg)


def jump_limit_mm(cell: "Cell | None") -> float:
    """Return the largest change that takes no engineer: the cell's, or the usual one."""
    limit = cell.settings.max_change_mm if cell else None
    return USUAL_CHANGE_MM if limit is None else limit


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


def accept_jump(
    controller: "Controller", tool: int, jump: "Jump", *, allowed: Allowed, accepted: Allowed
) -> bool:
    """Have a jump accepted by who may accept it; False where it is none and nobody was asked.

    ``--yes`` does not answer this question: it was typed before the figure was known.

    Args:
        controller: The controller, connected.
        tool: Number of the tool.
        jump: How far its tip would be taken.
        allowed: What the cell allows.
        accepted: What was accepted beforehand.

    Raises:
        NotAllowedError: It takes an engineer; nobody was asked.
        DeclinedError: The answer was no, or nobody could be asked.
    """
    from robolink.model import PersonRole, require_engineer

    if not jump.exceeds(*allowed):
        return False
    outcomes = controller.outcomes
    # Who may not is refused, not asked.
    if outcomes.signature.role != PersonRole.OPERATOR and jump.exceeds(
        accepted.length_mm or allowed.length_mm, accepted.angle_deg or allowed.angle_deg
    ):
        _ask(tool, jump, allowed)
    require_engineer(
        outcomes,
        tr(
            "let tool {tool} jump by {change:.3f} mm and {turn:.3f} degrees",
            tool=tool,
            change=jump.length_mm,
            turn=jump.angle_deg,
        ),
    )
    return True


def _ask(tool: int, jump: "Jump", allowed: Allowed) -> None:
    figure = _figure(tool, jump, allowed)
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


def _figure(tool: int, jump: "Jump", allowed: Allowed) -> str:
    sentences = []
    if allowed.length_mm is not None and jump.length_mm > allowed.length_mm:
        sentences.append(
            tr(
                "The tip of tool {tool} would move {change:.3f} mm; this cell allows "
                "{limit:.3f} mm.",
                tool=tool,
                change=jump.length_mm,
                limit=allowed.length_mm,
            )
        )
    if allowed.angle_deg is not None and jump.angle_deg > allowed.angle_deg:
        sentences.append(
            tr(
                "Tool {tool} would turn by {turn:.3f} degrees; this cell allows {limit:.3f}.",
                tool=tool,
                turn=jump.angle_deg,
                limit=allowed.angle_deg,
            )
        )
    return joined(" ", sentences)
