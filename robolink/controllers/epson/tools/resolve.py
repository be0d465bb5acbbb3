"""Settles what an earlier process left open: by reading, and with a person's word.

Nothing is sent again. A value that was being written is read; a robot that was told to move
is looked at; the cell's own tool is selected again when a person says so.
"""

from robolink.controllers.epson.io.pending_values import PendingValues
from robolink.controllers.epson.motion.group import EpsonGroup
from robolink.controllers.epson.tools.preserve import InForce, Preserver
from robolink.controllers.epson.tools.table import EpsonToolTable
from robolink.controllers.findings import (
    examine_move,
    examine_select,
    examine_write,
    judge_selection,
)
from robolink.controllers.markers import MarkerStore
from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.model import Finding, Marker, MarkerKind, Verdict
from robolink.ways import Way, way


class EpsonResolver:
    """Examines and settles the open markers that this driver begins."""

    def __init__(
        self,
        markers: MarkerStore,
        *,
        tools: EpsonToolTable,
        group: EpsonGroup,
        preserver: Preserver,
        values: PendingValues,
    ) -> None:
        self._markers = markers
        self._tools = tools
        self._group = group
        self._preserver = preserver
        self._values = values

    def examine(self, marker: Marker) -> Finding:
        """Read what is needed to judge ``marker``; see :class:`robolink.model.Resolver`."""
        details = marker.details
        if marker.kind is MarkerKind.MOVE:
            self._group.pose()  # refused while the robot moves
            return examine_move(marker)
        if marker.kind is MarkerKind.SELECTION:
            return self._examine_selection(marker)
        if "select" in details:
            return examine_select(self._tools, marker)
        if "raw" in details:
            return _examine_raw(marker)
        if "item" in details:
            return self._values.examine(marker)
        if "tool" in details:
            return examine_write(self._tools, marker)
        raise ConfigError(
            tr("The marker of {when} cannot be understood.", when=marker.begun_at),
            remedy=tr("Look at the controller, then {forget}.", forget=way(Way.FORGET_MARKER)),
        )

    def settle(self, finding: Finding) -> None:
        """Do what ``finding.action`` says and forget the marker."""
        if finding.verdict is Verdict.NOT_RESTORED:
            self._preserver.restore(InForce.from_marker(finding.marker), finding.marker)
        else:
            self._markers.clear(finding.marker, *finding.entries)

    def _examine_selection(self, marker: Marker) -> Finding:
        before, now = InForce.from_marker(marker), self._tools.selected()
        restored = now == before.tool and self._group.settings.read() == before.settings
        if now == before.tool:
            action = tr("set power mode and speed as they were")
        else:
            action = tr(
                "select tool {tool} again, with the power mode and speed of then", tool=before.tool
            )
        return judge_selection(
            marker, now=now, before=before.tool, restored=restored, action=action
        )


def _examine_raw(marker: Marker) -> Finding:
    sentence = tr(
        "Nobody but you can tell what {statement!r} did. Look at the controller.",
        statement=marker.request,
    )
    return Finding(marker, Verdict.LOOK, sentence)
