"""Settles what an earlier process left open: by reading, and with a person's word.

Nothing is sent again. What was being written is read; a robot that was told to move is looked
at; the cell's own tool is selected again when a person says so.
"""

from robolink.controllers.findings import (
    examine_move,
    examine_select,
    examine_write,
    judge_selection,
)
from robolink.controllers.softmotion.link.condition import require_still
from robolink.controllers.softmotion.link.mailbox import Mailbox
from robolink.controllers.softmotion.motion.group import SoftMotionGroup
from robolink.controllers.softmotion.tools.preserve import Preserver, tool_before
from robolink.controllers.softmotion.tools.table import SoftMotionToolTable
from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.model import Finding, Marker, MarkerKind, Verdict
from robolink.ways import Way, way


class SoftMotionResolver:
    """Examines and settles the open markers that this driver begins."""

    def __init__(
        self,
        mailbox: Mailbox,
        *,
        tools: SoftMotionToolTable,
        group: SoftMotionGroup,
        preserver: Preserver,
    ) -> None:
        self._mailbox = mailbox
        self._tools = tools
        self._group = group
        self._preserver = preserver

    def examine(self, marker: Marker) -> Finding:
        """Read what is needed to judge ``marker``; see :class:`robolink.model.Resolver`."""
        details = marker.details
        if marker.kind is MarkerKind.MOVE:
            now = self._mailbox.snapshots.take()
            require_still(now, controller=self._mailbox.identity, request=tr("recover"))
            return examine_move(marker)
        if marker.kind is MarkerKind.SELECTION:
            return self._examine_selection(marker)
        if "select" in details:
            return examine_select(self._tools, marker)
        if "kinematics" in details:
            return self._examine_kinematics(marker)
        if "output" in details:
            return _examine_output(marker)
        if "tool" in details:
            return examine_write(self._tools, marker)
        raise ConfigError(
            tr("The marker of {when} cannot be understood.", when=marker.begun_at),
            remedy=tr("Look at the PLC, then {forget}.", forget=way(Way.FORGET_MARKER)),
        )

    def settle(self, finding: Finding) -> None:
        """Do what ``finding.action`` says and forget the marker."""
        if finding.verdict is Verdict.NOT_RESTORED:
            self._preserver.restore(finding.marker)
        else:
            self._mailbox.markers.clear(finding.marker, *finding.entries)

    def _examine_kinematics(self, marker: Marker) -> Finding:
        now = self._mailbox.snapshots.take().kinematics
        done = now == marker.details["kinematics"]
        sentence = tr("Kinematics {now:#06x} is in force now.", now=now)
        return Finding(marker, Verdict.DONE if done else Verdict.NOT_APPLIED, sentence)

    def _examine_selection(self, marker: Marker) -> Finding:
        before, now = tool_before(marker), self._tools.selected()
        action = tr("select tool {tool} again", tool=before)
        return judge_selection(
            marker, now=now, before=before, restored=now == before, action=action
        )


def _examine_output(marker: Marker) -> Finding:
    sentence = tr(
        "A PLC's output cannot be read through the mailbox: look what {request!r} did.",
        request=marker.request,
    )
    return Finding(marker, Verdict.LOOK, sentence)
