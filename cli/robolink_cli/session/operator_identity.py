"""Who works at the cell, and with which nozzle: part of every journal entry."""

from dataclasses import replace
from typing import TYPE_CHECKING, Annotated

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink_cli.console.person import person_here
from robolink_cli.console.render import json_is_on
from robolink_cli.options.declaration import CliOption
from robolink_cli.options.shared import LINE

if TYPE_CHECKING:
    from robolink.config import Expected
    from robolink.model import Signature


Nozzle = Annotated[
    str | None,
    LINE,
    CliOption(metavar="ID", help="Id of the nozzle or needle that is mounted, for the record."),
]

Lot = Annotated[str | None, LINE, CliOption(metavar="LOT", help="Its lot, for the record.")]


def signature_of(operator: str | None, cell: "Expected | None", *, changes: bool) -> "Signature":
    """Return who works here, with the role from the cell file.

    Where the cell names people, a change asks for a badge on a terminal; who is not known
    counts as an operator.

    Args:
        operator: The badge or name that was given.
        cell: What the cell file says, if ``-c`` named a cell.
        changes: Whether the command may change something.

    Raises:
        ConfigError: The cell names people, and this is none of them.
        DeclinedError: Nobody gave a name.
    """
    from robolink import __version__
    from robolink.journal import signature_here
    from robolink.model import PersonRole

    people = cell.people if cell else None
    here = signature_here(__version__)
    if people is None:
        return replace(here, operator=operator or "")
    if operator is None and changes:
        operator = _asked_for_badge()
    if not operator:
        return replace(here, role=PersonRole.OPERATOR)
    if operator not in people:
        raise ConfigError(
            tr("{operator!r} is not among the people of this cell.", operator=operator),
            remedy=tr(
                "Give --operator as in the cell file, or have it added there under 'people'."
            ),
        )
    return replace(here, operator=operator, role=people[operator])


def _asked_for_badge() -> str:
    from robolink_cli.prompts.questions import asked_for_text

    if json_is_on() or not person_here():
        return ""
    return LINE.convert(asked_for_text(tr("Who works here (badge or name)?")), None, None)
