"""Settles what an earlier process left open on a PLC behind a mailbox."""

from robolink.controllers.preserving import Preserver
from robolink.controllers.resolving import MarkerResolver
from robolink.controllers.softmotion.link.condition import require_still
from robolink.controllers.softmotion.link.mailbox import Mailbox
from robolink.controllers.softmotion.tools.table import SoftMotionToolTable
from robolink.messages import tr
from robolink.model import Finding, Marker, Verdict


class SoftMotionResolver(MarkerResolver):
    """Examines and settles the open markers that this driver begins."""

    def __init__(self, mailbox: Mailbox, tools: SoftMotionToolTable, preserver: Preserver) -> None:
        super().__init__(mailbox, tools, preserver)
        self._mailbox = mailbox

    def fence(self) -> None:
        """Take the mailbox: a block that is under way belongs to an epoch of before then."""
        self._mailbox.commands.ownership.fence()

    def _require_rest(self) -> None:
        now = self._mailbox.snapshots.take()
        require_still(now, controller=self._mailbox.identity, request=tr("recover"))

    def _examine_more(self, marker: Marker) -> Finding | None:
        if "kinematics" in marker.details:
            return self._examine_kinematics(marker)
        return _examine_output(marker) if "output" in marker.details else None

    def _examine_kinematics(self, marker: Marker) -> Finding:
        now = self._mailbox.snapshots.take().kinematics
        done = now == marker.details["kinematics"]
        sentence = tr("Kinematics {now:#06x} is in force now.", now=now)
        return Finding(marker, Verdict.DONE if done else Verdict.NOT_APPLIED, sentence)


def _examine_output(marker: Marker) -> Finding:
    sentence = tr(
        "A PLC's output cannot be read through the mailbox: look at what {request!r} did.",
        request=marker.request,
    )
    return Finding(marker, Verdict.LOOK, sentence)
