"""Whether a command is shown as a wizard, and what stands in its first row."""

from collections.abc import Callable
from typing import TypeVar

from robolink_cli.session.context import CliContext

T = TypeVar("T")


def guided_if_alone(
    context: CliContext,
    do: Callable[[], T],
    *,
    job: str,
    tools: tuple[int, ...],
    alone: bool = True,
) -> T:
    """Do the work of a command; as a wizard where a person sits at the terminal.

    Args:
        context: What the command was told.
        do: The work.
        job: What it is called in the first row.
        tools: The tools at work.
        alone: Whether it is a person who is asked, and not a simulator's stand-in for one.

    Raises:
        BaseException: Whatever ended the work.
    """
    from robolink_cli.wizard.host import guided, may_be_guided

    if not alone or not may_be_guided():
        return do()
    from robolink_cli.wizard.state import Header

    url = context.require_url()
    name = context.cell.name if context.cell is not None else url.partition("?")[0]
    return guided(Header(name, job, simulated="+sim://" in url, tools=tools), do)
