"""Settles what an earlier process left open.

By reading; and where there is a handshake, by asking the PLC once more to take over what
stands in its registers, which changes nothing if it did so before.
"""

from dataclasses import replace

from robolink.controllers.plc_map.link import MappedPlc
from robolink.controllers.plc_map.tools import RegisterToolTable
from robolink.controllers.preserving import Preserver
from robolink.controllers.resolving import MarkerResolver, examine_write
from robolink.messages import tr
from robolink.model import Finding, Marker, MarkerKind, Verdict, read_offset


class RegisterResolver(MarkerResolver):
    """Examines and settles the open markers that this driver begins."""

    def __init__(self, plc: MappedPlc, tools: RegisterToolTable, preserver: Preserver) -> None:
        super().__init__(plc, tools, preserver)
        self._plc = plc
        self._registers = tools
        self._waited = False

    def fence(self) -> None:
        """Wait until what was sent earlier has arrived, once in a session.

        A request that stands then is switched off before the PLC is asked for anything.
        """
        if not self._waited:
            self._registers.handshake.wait_out()
            self._waited = True

    def settle(self, finding: Finding) -> None:
        """Do what ``finding.action`` says and forget the marker."""
        marker = finding.marker
        if finding.verdict is Verdict.NOT_FINISHED:
            tool = int(str(marker.details["tool"]))
            self._plc.require_ready(tool, marker.request)
            before = read_offset(marker.details.get("before"))
            self._registers.take_over(tool, before, marker.request)
        super().settle(finding)

    def _examine_more(self, marker: Marker) -> Finding | None:
        """Judge a write.

        Registers that hold the new value do not prove that the PLC took it over: the process
        may have died between the values and the request.
        """
        if marker.kind is not MarkerKind.SET or "tool" not in marker.details:
            return None
        finding = examine_write(self._registers, marker)
        if finding.verdict is not Verdict.DONE or not self._registers.handshake.answers:
            return finding
        sentence = tr("{holds} It is not known whether the PLC took it.", holds=finding.sentence)
        action = tr("ask the PLC once more to take what is in the registers")
        return replace(finding, verdict=Verdict.NOT_FINISHED, sentence=sentence, action=action)
