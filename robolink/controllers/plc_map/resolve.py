"""Settles what an earlier process left open.

By reading; and where there is a handshake, by asking the PLC once more to take over what
stands in its registers, which changes nothing if it did so before.
"""

from collections.abc import Callable
from dataclasses import replace

from robolink.controllers.findings import examine_write
from robolink.controllers.markers import MarkerStore
from robolink.controllers.plc_map.tools import RegisterToolTable
from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.model import Finding, Marker, MarkerKind, Verdict, read_offset
from robolink.ways import Way, way


class RegisterResolver:
    """Examines and settles the open markers that this driver begins."""

    def __init__(
        self,
        markers: MarkerStore,
        tools: RegisterToolTable,
        *,
        require_ready: Callable[[str], None],
    ) -> None:
        self._markers = markers
        self._tools = tools
        self._require_ready = require_ready

    def examine(self, marker: Marker) -> Finding:
        """Read what is needed to judge ``marker``; see :class:`robolink.model.Resolver`.

        Registers that hold the new value do not prove that the PLC took it over: the process
        may have died between the values and the request.
        """
        if marker.kind is not MarkerKind.SET or "tool" not in marker.details:
            raise ConfigError(
                tr("The marker of {when} cannot be understood.", when=marker.begun_at),
                remedy=tr("Look at the machine, then {forget}.", forget=way(Way.FORGET_MARKER)),
            )
        finding = examine_write(self._tools, marker)
        if finding.verdict is not Verdict.DONE or not self._tools.handshake.answers:
            return finding
        sentence = tr("{holds} Whether the PLC took it over is not known.", holds=finding.sentence)
        action = tr("ask the PLC once more to take over what stands in the registers")
        return replace(finding, verdict=Verdict.NOT_FINISHED, sentence=sentence, action=action)

    def settle(self, finding: Finding) -> None:
        """Do what ``finding.action`` says and forget the marker."""
        marker = finding.marker
        if finding.verdict is Verdict.NOT_FINISHED:
            self._require_ready(marker.request)
            before = read_offset(marker.details.get("before"))
            self._tools.take_over(int(str(marker.details["tool"])), before, marker.request)
        self._markers.clear(marker, *finding.entries)
