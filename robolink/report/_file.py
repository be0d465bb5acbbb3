"""A report as a file."""

from pathlib import Path

from robolink.named_files import save_named
from robolink.report._page import render
from robolink.report._values import Report


def save(report: Report, path: Path, *, replace: bool = False) -> None:
    """Write the page; it is whole and on the disk when this returns.

    Raises:
        ConfigError: A file is there already and ``replace`` is not set, or it cannot be
            written. What was there is unchanged.
    """
    save_named(path, render(report).encode("utf-8"), replace=replace)
