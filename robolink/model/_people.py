"""Who may do what at a cell."""

from enum import StrEnum

from robolink.errors import NotAllowedError
from robolink.messages import tr
from robolink.model.record.journal_entries import EntryKind, NewEntry
from robolink.model.record.outcomes import OutcomeLog
from robolink.ways import Way, way


class PersonRole(StrEnum):
    """What a person is, by the cell file.

    An operator changes nozzles. Passing the jump limit, clearing a tool, undo, restore, writes
    without an expected value and raw statements take an engineer.
    """

    OPERATOR = "operator"
    ENGINEER = "engineer"


def require_engineer(outcomes: OutcomeLog, act: str, **details: object) -> None:
    """Refuse ``act`` to an operator, and put on record who else did it.

    Where the cell names no people, everybody may; it is recorded all the same.

    Args:
        outcomes: Where it goes on record.
        act: What it takes an engineer for.
        details: More for the record, plain JSON.

    Raises:
        NotAllowedError: The person is an operator.
        ConfigError: It cannot be recorded.

    Example:
        >>> import robolink
        >>> from robolink.model import require_engineer
        >>> with robolink.connect("epson+sim://engineer-example") as controller:
        ...     require_engineer(controller.outcomes, "accept a jump", tool=1)  # nobody is named
    """
    refuse_operator(outcomes, act)
    said = {**details, "engineer": True}
    outcomes.append(NewEntry(EntryKind.DECISION, verdict=act, details=said))


def refuse_operator(outcomes: OutcomeLog, act: str) -> None:
    """Refuse ``act`` to an operator; nothing is put on record.

    Args:
        outcomes: Knows who works here.
        act: What it takes an engineer for.

    Raises:
        NotAllowedError: The person is an operator.

    Example:
        >>> import robolink
        >>> from robolink.model import refuse_operator
        >>> with robolink.connect("epson+sim://operator-example") as controller:
        ...     refuse_operator(controller.outcomes, "accept a jump")  # nobody is named
    """
    signature = outcomes.signature
    if signature.role == PersonRole.OPERATOR:
        person = signature.operator or tr("somebody who gave no name")
        raise NotAllowedError(
            tr("{person} may not {act}. Ask an engineer.", person=person, act=act),
            remedy=tr(
                "Nothing was sent. Somebody listed as an engineer in the cell file "
                "may do it, with {operator}.",
                operator=way(Way.OPERATOR),
            ),
        )
