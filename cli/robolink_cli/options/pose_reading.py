"""What a person says about a file of poses because the file does not."""

from collections.abc import Callable
from functools import wraps
from typing import Any

import click

from robolink.messages import declared
from robolink.pose_tables import ReadingChoices


def reading_options(function: Callable[..., Any]) -> Callable[..., Any]:
    """Add ``--columns``, ``--length`` and ``--euler``, passed on as ``choices``."""

    @wraps(function)
    def with_choices(
        *args: object,
        columns: str | None,
        length: str | None,
        euler: str | None,
        **others: object,
    ) -> object:
        return function(*args, choices=ReadingChoices(columns, length, euler), **others)

    command: Callable[..., Any] = with_choices
    for option in (
        click.option(
            "--euler",
            metavar="NAME",
            help=declared(
                "How its angles turn: epson, kuka, fanuc, xyzrpw, codesys, rotvec, RzRyRx .."
            ),
        ),
        click.option(
            "--length",
            type=click.Choice(["mm", "cm", "m", "in"]),
            help=declared("Unit of its lengths, when the file does not say it."),
        ),
        click.option(
            "--columns",
            metavar="x,y,z,u",
            help=declared("What its columns are, when the file does not say it; '-' skips one."),
        ),
    ):
        command = option(command)
    return command
