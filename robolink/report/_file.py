"""A report as a file."""

from collections.abc import Sequence
from pathlib import Path

from robolink.files.named import save_named
from robolink.report._page import render
from robolink.report._values import Report


def save(
    report: Report, path: Path, *, others: Sequence[Report] = (), replace: bool = False
) -> None:
    """Write the page of a change; it is whole and on the disk when this returns.

    Args:
        report: What became of a tool.
        path: Where.
        others: The same of the other tools of that change.
        replace: Whether a file that is there may go.

    Raises:
        ConfigError: A file is there already and ``replace`` is not set, or it cannot be
            written. What was there is unchanged.
    """
    save_named(path, render(report, *others).encode("utf-8"), replace=replace)
