"""Whether a command is shown as a wizard, and what stands in its first row."""

import os
import shlex
from collections.abc import Callable
from typing import TYPE_CHECKING, TypeVar

import click

from robolink_cli.console.tolerance import may_be_guided
from robolink_cli.options.shared import TYPED
from robolink_cli.session.context import CliContext

if TYPE_CHECKING:
    from robolink_cli.wizard.state import Header

T = TypeVar("T")


def guided_if_alone(
    context: CliContext,
    do: Callable[[], T],
    *,
    job: str,
    alone: bool = True,
    following: Callable[[], T] | None = None,
    steps: int = 0,
) -> T:
    """Do the work of a command; as a wizard where a person sits at the terminal.

    Args:
        context: What the command was told.
        do: The work.
        job: What it is called in the first row.
        alone: Whether it is a person who is asked, and not a simulator's stand-in for one.
        following: What begins for the next tool, with a choice; ``None`` where none can.
        steps: How many numbered steps it has, 0 for none.

    Raises:
        BaseException: Whatever ended the work.
    """
    if not alone or not may_be_guided():
        return do()
    from robolink_cli.wizard.host import guided

    head = header_of(context, job, steps=steps)
    return guided(head, do, report=_page, following=following)


def _page(change: str) -> tuple[str, ...]:
    from robolink_cli.access.change_page import page_of_change  # report and journal, not before

    return page_of_change(change)


def header_of(
    context: CliContext,
    job: str,
    *chosen: str,
    needle: str = "",
    anew: bool = False,
    steps: int = 0,
) -> "Header":
    """Return the first row of a command's screens.

    Args:
        context: What the command was told.
        job: What it is called.
        chosen: What was chosen from a list, as it would be typed behind the command.
        needle: Id of the needle that is mounted.
        anew: Whether the line that began the command was about another job.
        steps: How many numbered steps the job has, 0 for none.
    """
    from robolink_cli.wizard.state import Header

    url = context.url or ""
    name = context.cell.name if context.cell is not None else url.partition("?")[0]
    return Header(
        name,
        job,
        simulated="+sim://" in url,
        command=_typed_again(context, chosen, anew=anew),
        needle=needle,
        steps=steps,
    )


def _typed_again(context: CliContext, chosen: tuple[str, ...], *, anew: bool) -> str:
    """Return the command line that begins the same job, with what was chosen meanwhile."""
    typed = () if anew else click.get_current_context().meta.get(TYPED, ())
    words = [*typed, *chosen]
    if anew and context.cell is None and context.url is not None:
        words = ["-c", context.url, *words]
    named = any(word in ("-c", "--controller") or word[:13] == "--controller=" for word in words)
    if context.cell is not None and not named:
        words = ["-c", context.cell.name, *words]
    words = ["robolink", *words]
    if os.name != "nt":
        return shlex.join(words)
    import subprocess

    # cmd.exe and PowerShell both know double quotes; single ones are letters to cmd.exe.
    return subprocess.list2cmdline(words)
