"""The sentences for packages that do not fit robolink.

Then anything may fail anywhere, ``import click`` included, and no failure is a defect of
robolink. So nothing is imported here but Python's own library and what of ours needs no more.
"""

import json
import sys
from collections.abc import Sequence
from contextlib import suppress
from typing import Final

from robolink.messages import first_sentence, listed, tr
from robolink_cli.commands.computer.checkup import Level, Remark, check_versions
from robolink_cli.console.error_lines import error_lines
from robolink_cli.console.language import speaking_for
from robolink_cli.console.output import terminal_width, tolerate_any_console, visible

MOST_NAMED = 8
"""Largest number of packages that the error lists."""

_FOUND = 1
_NOT_RUNNABLE = 2
_NOTHING_BEGUN: Final[dict[str, object]] = {
    "reason": None,
    "code": None,
    "ended_by": None,
    "controller_state": "unchanged",
    "stands": {
        "tools": {},
        "selected_tool": None,
        "selected_before": None,
        "carried_out": [],
        "doubtful": [],
        "moving": [],
        "settled": True,
        "left_open": False,
    },
}
"""Remaining fields of an error document, as for a command that reached no controller."""


def unfit_packages() -> list[Remark]:
    """Return missing packages and unfit versions; usually nothing."""
    with suppress(Exception):  # unreadable metadata prove nothing
        return [remark for remark in check_versions() if remark.level is Level.BAD]
    return []


def cannot_run(unfit: Sequence[Remark], error: BaseException) -> str:
    """Return the sentence for a failure with unfit packages.

    Args:
        unfit: Those packages, at least one.
        error: What the failure was.
    """
    found = [f"{one.subject}: {one.what} {one.remedy}" for one in unfit]
    kind = type(error).__name__
    return listed(
        tr("robolink cannot work with the packages that are installed:"),
        [*_most(found), f"{kind}: {first_sentence(str(error))}"],
    )


def how_to_fit() -> str:
    """Return what to do about unfit packages; the list of :func:`cannot_run` says it of each."""
    return tr("Correct what is listed, then run the command again.")


def _most(lines: Sequence[str]) -> list[str]:
    """Return so many lines as a person reads."""
    more = len(lines) - MOST_NAMED
    return [*lines[:MOST_NAMED], *([tr("and {more} more", more=more)] if more > 0 else [])]


def answer_without_click(arguments: Sequence[str], error: Exception) -> int:
    """Answer a command line whose program could not be imported; return the exit code.

    ``doctor`` looks at everything all the same. Any other command says what does not fit.

    Args:
        arguments: The command line without the program's name.
        error: Why the import failed.

    Raises:
        Exception: ``error`` itself, where every package fits: then it is a defect.
    """
    unfit = unfit_packages()
    if not unfit:
        raise error
    tolerate_any_console()
    with speaking_for(arguments):
        if "doctor" in arguments:
            return _examined(as_json="--json" in arguments)
        what, remedy = cannot_run(unfit, error), how_to_fit()
        if "--json" in arguments:
            told = {"kind": type(error).__name__, "what": what, "remedy": remedy}
            body = {**told, **_NOTHING_BEGUN}
            document = {"schema": "robolink/error/1", "error": body, "exit_code": _NOT_RUNNABLE}
            sys.stdout.write(json.dumps(document, indent=2) + "\n")
        else:
            lines = error_lines(what, remedy, width=terminal_width(sys.stderr))
            sys.stderr.write(visible(lines) + "\n")
    return _NOT_RUNNABLE


def _examined(*, as_json: bool) -> int:
    from dataclasses import asdict

    from robolink_cli.commands.computer.checkup import check_up, in_words

    remarks = check_up()
    if as_json:
        document = {"schema": "robolink/doctor/1", "healthy": False}
        checks = [asdict(remark) for remark in remarks]
        sys.stdout.write(json.dumps(document | {"checks": checks}, indent=2) + "\n")
    else:
        sys.stdout.write(visible("\n".join(in_words(remarks))) + "\n")
    return _FOUND
