"""Puts back what a procedure changed: the selected tool slot, and nothing else.

Power and speed need no putting back on a PLC: each command carries its own. A durable marker
names the cell's own tool before anything is changed, and goes only when that slot is read
back as selected (docs/reference/rules.md 4).
"""

from collections.abc import Iterator
from contextlib import contextmanager

from robolink.controllers.markers import unrestored_tool
from robolink.controllers.softmotion.link.mailbox import Mailbox
from robolink.controllers.softmotion.motion.group import SoftMotionGroup
from robolink.controllers.softmotion.tools.table import SoftMotionToolTable
from robolink.errors import ConfigError, RobolinkError
from robolink.messages import tr
from robolink.model import Marker, MarkerKind
from robolink.ways import Way, way


class Preserver:
    """Remembers at the start of a procedure, restores at its end."""

    def __init__(
        self, mailbox: Mailbox, *, tools: SoftMotionToolTable, group: SoftMotionGroup
    ) -> None:
        self._mailbox = mailbox
        self._tools = tools
        self._group = group

    @contextmanager
    def preserved(self, reason: str) -> Iterator[None]:
        """See :meth:`robolink.model.Controller.preserved`."""
        mailbox = self._mailbox
        with mailbox.lock.held(reason), mailbox.markers.ledger.block():
            mailbox.markers.require_settled(reason)
            tool = self._tools.selected()
            marker: Marker | None = None
            try:
                with mailbox.uninterrupted():
                    details = {"tool": tool, "now": tool}
                    marker = mailbox.markers.begin(MarkerKind.SELECTION, reason, details)
                yield
            except BaseException as error:
                if marker is not None:
                    self._restore_after(error, marker)
                raise
            self.restore(marker)

    def restore(self, marker: Marker) -> None:
        """Select the tool that ``marker`` names, and forget it; Ctrl-C waits for the end."""
        tool = tool_before(marker)
        with self._mailbox.uninterrupted(), self._mailbox.wire.latch.restoring():
            self._group.abort_unfinished()
            self._tools.select(tool)
            self._mailbox.markers.clear(marker)

    def _restore_after(self, error: BaseException, marker: Marker) -> None:
        """Restore while ``error`` is on its way; if impossible, let it say what is left."""
        try:
            self.restore(marker)
        except RobolinkError as second:
            if isinstance(error, RobolinkError):
                left = unrestored_tool(second, tool_before(marker))
                error.remedy = f"{error.remedy} {left}".strip()


def tool_before(marker: Marker) -> int:
    """Return the tool that was in force when a procedure began.

    Raises:
        ConfigError: The marker was written by something else.
    """
    tool = marker.details.get("tool")
    if not isinstance(tool, int):
        raise ConfigError(
            tr("The marker of {when} cannot be understood.", when=marker.begun_at),
            remedy=tr(
                "Select the right tool by hand, then {forget}.", forget=way(Way.FORGET_MARKER)
            ),
        )
    return tool
