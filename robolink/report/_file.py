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

    Example:
        >>> from pathlib import Path
        >>> from robolink import ToolOffset
        >>> from robolink.report import reports_of, save
        >>> from robolink.testing import MemoryController
        >>> from robolink.transaction import Wanted, change_tools
        >>> controller = MemoryController()
        >>> receipts = change_tools(controller, [Wanted(3, ToolOffset(1, 2, -30), None)])
        >>> entries = tuple(reversed(list(controller.outcomes.recorded(tool=3))))
        >>> about = {"made_at": "2026-11-23T08:00:00Z", "robolink_version": "0.1.0"}
        >>> (report,) = reports_of(entries, check="The journal is whole.", **about)
        >>> save(report, Path("report.html"))
        >>> Path("report.html").exists()
        True
    """
    save_named(path, render(report, *others).encode("utf-8"), replace=replace)
