"""The words for what is wrong with one key of a recipe. They never repeat the value."""

from collections.abc import Iterable, Sequence
from difflib import get_close_matches
from typing import Any

from robolink.messages import tr
from robolink.methods.fields import at_least, at_most, holds_at_least, holds_at_most


def unknown(key: str, table: Sequence[str], top: Sequence[str]) -> str:
    """Return what to say about a key that does not exist where it stands.

    Args:
        key: The key.
        table: The keys that are known there.
        top: The keys that are known at the top of the file.
    """
    if key in top:
        return tr("belongs at the top of the file, above the first line with a [table]")
    close = get_close_matches(key, table, n=1)
    if close:
        return tr("is not known; is {name} meant?", name=close[0])
    return tr("is not known; these are: {names}", names=", ".join(table))


def missing(key: str) -> str:
    """Return what to say about a key that is required."""
    match key:
        case "basis":
            return tr(
                "is missing, and it has to be decided, because taught points agree only with the "
                'tool value that they were taught with. Write "difference" to move the stored '
                "value by how much the tip moved against the reference of the same tool at the "
                "same station (the first run only records that reference, with the nozzle still "
                'on with which the points were taught), or "absolute" to write what was measured.'
            )
        case "z":
            return tr(
                'is missing: write "kept" when the new nozzle is as long as the old one (the '
                'person confirms it each time), "typed" when the person enters Z each time, or '
                '"measured" when the touch of the pin gives it'
            )
        case "tools":
            return tr("is missing: write one [[tools]] table for each tool")
        case "schema":
            return tr('is missing: begin the file with schema = "robolink/recipe/1"')
    return tr("is missing")


def one_of(values: Iterable[str]) -> str:
    """Return what to say about a value that is none of those that exist."""
    return tr("must be one of {values}", values=", ".join(f'"{value}"' for value in values))


def sentence(detail: Any) -> str:  # noqa: ANN401 - pydantic's own form
    """Return what to say about a value that pydantic objects to."""
    limits = detail.get("ctx", {})
    match detail["type"]:
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
            expected = limits["expected"].replace("'", '"')
            return tr("must be {expected}", expected=expected)
    return _of_its_type(detail["type"]) or str(detail["msg"])


def _of_its_type(kind: str) -> str:
    match kind:
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
        case "string_pattern_mismatch":
            return tr("must not hold control characters or, except in notes, line breaks")
        case "model_type" | "model_attributes_type":
            return tr("must be a table")
        case "tuple_type":
            return tr("must be a list in brackets")
    return ""
