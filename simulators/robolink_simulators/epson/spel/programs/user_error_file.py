"""Errors that a project defines: UserErrors.dat, as RC+ writes it (docs/reference/spel.md 16)."""

from pathlib import Path
from typing import Final

from robolink_simulators.epson.spel.session import UserError
from robolink_simulators.epson.spel.source.point_file import blocks, project_text

_FIRST: Final = 8000
_LAST: Final = 8999


def read_user_errors(path: Path, encoding: str | None = None) -> dict[str, UserError]:
    """Return the errors by their labels in lower case; one with no label or number is left out.

    Raises:
        ConfigError: It cannot be read.
    """
    errors = dict[str, UserError]()
    for _, pairs in blocks(project_text(path, encoding)):
        number, label = pairs.get("nError", ""), pairs.get("sLabel", "")
        if label and number.isdecimal() and _FIRST <= int(number) <= _LAST:
            errors[label.lower()] = UserError(int(number), pairs.get("sMessage", ""))
    return errors
