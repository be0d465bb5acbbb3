"""Asking before something changes, and the options that answer beforehand."""

import sys
from collections.abc import Callable
from typing import Any, TypeVar

import click

from robolink.errors import DeclinedError
from robolink.messages import tr

F = TypeVar("F", bound=Callable[..., Any])


def dry_run_option(function: F) -> F:
    """Add ``--dry-run``."""
    return click.option(
        "--dry-run",
        is_flag=True,
        help="Show the exact requests and check the limits; read only, write nothing.",
    )(function)


def yes_option(function: F) -> F:
    """Add ``--yes``."""
    return click.option("--yes", is_flag=True, help="Answer yes to the question asked.")(function)


def on_terminal() -> bool:
    """Tell whether a person can be asked."""
    return sys.stdin.isatty() and sys.stderr.isatty()


def agree(question: str, *, yes: bool) -> None:
    """Ask on a terminal; off it, the command itself is the consent (design part 9).

    Raises:
        DeclinedError: The answer was no.
    """
    if not yes and on_terminal() and not click.confirm(question, err=True):
        raise DeclinedError(tr("You said no."), remedy=tr("Nothing was sent."))


def agree_to_motion(question: str, *, yes: bool) -> None:
    """Ask before the robot moves; without a terminal only ``--yes`` is consent.

    Raises:
        DeclinedError: The answer was no, or nobody could be asked.
    """
    if yes:
        return
    if not on_terminal():
        raise DeclinedError(
            tr("The robot would move, and nobody can be asked here."),
            remedy=tr("Run it on a terminal, or give --yes when the cell is clear."),
        )
    if not click.confirm(question, err=True):
        raise DeclinedError(tr("You said no."), remedy=tr("Nothing was sent."))
