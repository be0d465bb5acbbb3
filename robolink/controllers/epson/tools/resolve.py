"""Settles what an earlier process left open on an EPSON controller."""

from robolink.controllers.epson.io.pending_values import PendingValues
from robolink.controllers.epson.link.link import EpsonLink
from robolink.controllers.epson.motion.group import EpsonGroup
from robolink.controllers.epson.tools.preserve import EpsonPreserver
from robolink.controllers.epson.tools.table import EpsonToolTable
from robolink.controllers.resolving import MarkerResolver
from robolink.messages import tr
from robolink.model import Finding, Marker, Verdict


class EpsonResolver(MarkerResolver):
    """Examines and settles the open markers that this driver begins."""

    def __init__(
        self,
        link: EpsonLink,
        tools: EpsonToolTable,
        preserver: EpsonPreserver,
        *,
        group: EpsonGroup,
        values: PendingValues,
    ) -> None:
        super().__init__(link, tools, preserver)
        self._group = group
        self._values = values

    def _require_rest(self) -> None:
        self._group.pose()  # refused while the robot moves

    def _examine_more(self, marker: Marker) -> Finding | None:
        if "raw" in marker.details:
            sentence = tr(
                "This PC cannot see whether {statement!r} ran. Look at the controller, then "
                "choose.",
                statement=marker.request,
            )
            return Finding(marker, Verdict.LOOK, sentence)
        return self._values.examine(marker) if "item" in marker.details else None
