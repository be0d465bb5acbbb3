"""The option that says how imperfect a simulated cell is."""

from collections.abc import Callable
from typing import Any

import click


def world_option(function: Callable[..., Any]) -> Callable[..., Any]:
    """Add ``--world``."""
    decorate: Callable[[Callable[..., Any]], Callable[..., Any]] = click.option(
        "--world",
        multiple=True,
        metavar="NAME=VALUE",
        help="How imperfect the cell is, and how its camera is built; a wrong name lists all. May "
        "be repeated.",
    )
    return decorate(function)
