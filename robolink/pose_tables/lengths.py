"""The unit of length of a file: what it says, what its format is defined with, what is asked."""

from collections.abc import Sequence
from typing import Final

from robolink.messages import tr
from robolink.pose_tables.questions import looks_like_metres, which_length
from robolink.pose_tables.refusals import OpenQuestion, UnclearText, UnusableText
from robolink.pose_tables.values import LengthUnit, RawTable

_FAR_M: Final = 50.0
"""No robot stands this far from its base, so numbers beyond it are not metres."""


def settled_length(raw: RawTable, said: str | None) -> tuple[LengthUnit, str]:
    """Return the unit, and who says it: ``file``, ``format``, ``option`` or ``default``.

    Args:
        raw: What was read.
        said: The unit that a person names.

    Raises:
        UnclearText: Nobody says it, and it may be another than mm.
        UnusableText: A person names another unit than the file.
    """
    if said is not None:
        unit = _unit(said)
        if raw.stated_length and raw.length is not unit:
            why = tr("it says {length} itself, but {said} was given", length=raw.length, said=unit)
            raise UnusableText(why)
        return unit, "option"
    positions = [pose.position for pose in raw.poses]
    if raw.length is not None:
        far = any(abs(value) > _FAR_M for place in positions for value in place)
        if raw.length is LengthUnit.M and far:
            why = tr("its lengths should be metres, but are too large")
            raise UnclearText(which_length(why, [*positions, (_FAR_M * 3,)]))
        return raw.length, "file" if raw.stated_length else "format"
    if raw.unit_in_comment:
        why = tr("a comment speaks of a unit: {text!r}", text=raw.unit_in_comment)
        raise UnclearText(which_length(why, positions))
    asked = metres_question(positions)
    if asked:
        raise UnclearText(asked)
    return LengthUnit.MM, "default"


def metres_question(positions: Sequence[Sequence[float]]) -> OpenQuestion | None:
    """Return the question for the unit where numbers without one do not look like mm."""
    if not looks_like_metres(positions):
        return None
    return which_length(tr("its lengths have no unit, and do not look like mm"), positions)


def _unit(name: str) -> LengthUnit:
    try:
        return LengthUnit(name.strip().lower())
    except ValueError as error:
        raise UnusableText(
            tr("{name!r} is not a unit of length; use mm, cm, m or in", name=name)
        ) from error
