"""The sentences for a wrong key of a file. They never repeat the value.

A value may be a password in the wrong place. So every sentence is made from what pydantic found
out about it, never from the value itself.
"""

from collections.abc import Iterable
from difflib import get_close_matches
from typing import Any, Final

from robolink.messages import tr

_SHOWN: Final = 100
"""Largest number of characters shown of a list of keys."""


def is_not_known(key: str, table: Iterable[str]) -> str:
    """Return the sentence for a key that does not exist in its place.

    Args:
        key: The key.
        table: The keys that are known there.
    """
    names = tuple(table)
    close = get_close_matches(key, names, n=1)
    if close:
        return tr("is not known; did you mean {name}?", name=close[0])
    listed = ", ".join(names)
    if len(listed) > _SHOWN:
        listed = f"{listed[:_SHOWN].rpartition(', ')[0]} ..."
    return tr("is not known; these are: {names}", names=listed)


def one_of(values: Iterable[str]) -> str:
    """Return the sentence for a value that is none of the possible ones."""
    return tr("must be one of {values}", values=", ".join(f'"{value}"' for value in values))


def more_than(limit: object) -> str:
    """Return the sentence for a number that is not large enough."""
    return tr("must be more than {limit:g}", limit=limit)


def at_least(limit: object) -> str:
    """Return the sentence for a number that is too small."""
    return tr("must be at least {limit:g}", limit=limit)


def at_most(limit: object) -> str:
    """Return the sentence for a number that is too large."""
    return tr("must be at most {limit:g}", limit=limit)


def holds_at_least(count: object) -> str:
    """Return the sentence for a list that is too short."""
    return tr("must hold at least {count}", count=count)


def holds_at_most(count: object) -> str:
    """Return the sentence for a list that is too long."""
    return tr("must hold at most {count}", count=count)


def sentence(detail: Any) -> str:  # noqa: ANN401 - pydantic's own form
    """Return the sentence for a value that pydantic rejects.

    Args:
        detail: One of the errors of a ``ValidationError``, without the value.
    """
    limits = detail.get("ctx", {})
    match detail["type"]:
        case "greater_than":
            return more_than(limits["gt"])
        case "greater_than_equal":
            return at_least(limits["ge"])
        case "less_than_equal":
            return at_most(limits["le"])
        case "too_short":
            return holds_at_least(limits["min_length"])
        case "too_long":
            return holds_at_most(limits["max_length"])
        case "string_too_long":
            return tr("must be at most {count} characters long", count=limits["max_length"])
        case "literal_error":
            return tr("must be {expected}", expected=limits["expected"].replace("'", '"'))
        case "value_error":
            return str(limits["error"])
    return _of_its_type(detail["type"]) or str(detail["msg"])


def _of_its_type(kind: str) -> str:
    match kind:
        case "missing":
            return tr("is missing")
        case "float_type":
            return tr("must be a number")
        case "int_type":
            return tr("must be a whole number")
        case "finite_number":
            return tr("must be a finite number")
        case "bool_type":
            return tr("must be true or false")
        case "string_type":
            return tr("must be a text in quotes")
        case "string_too_short":
            return tr("must not be empty")
        case "model_type" | "model_attributes_type" | "dict_type":
            return tr("must be a table")
        case "tuple_type" | "list_type":
            return tr("must be a list in brackets")
    return ""
