"""Settles what an earlier process left open: by reading, and with a person's word.

Nothing is sent again. A value that was being written is read; a robot that was told to move
is looked at; the cell's own tool is selected again when a person says so.
"""

from robolink.controllers.epson._findings import Finding, Verdict
from robolink.controllers.epson._guarded import MarkerDesk
from robolink.controllers.epson._motion import EpsonGroup
from robolink.controllers.epson._preserve import InForce, Preserver
from robolink.controllers.epson._tools import EpsonToolTable, describe, same_tool
from robolink.controllers.epson._value_doubts import ValueDoubts
from robolink.messages import tr
from robolink.model import Marker, MarkerKind, ToolOffset
from robolink.protocols import spel


class Resolver:
    """Examines and settles open markers."""

    def __init__(
        self,
        desk: MarkerDesk,
        *,
        tools: EpsonToolTable,
        group: EpsonGroup,
        preserver: Preserver,
        values: ValueDoubts,
    ) -> None:
        self._desk = desk
        self._tools = tools
        self._group = group
        self._preserver = preserver
        self._values = values

    def examine(self, marker: Marker) -> Finding:
        """Read what is needed to judge ``marker``; changes nothing."""
        if marker.kind is MarkerKind.MOVE:
            return self._examine_move(marker)
        if marker.kind is MarkerKind.SELECTION:
            return self._examine_selection(marker)
        if "select" in marker.details:
            return self._examine_select(marker)
        if "item" in marker.details:
            return self._values.examine(marker)
        return self._examine_write(marker)

    def settle(self, finding: Finding) -> None:
        """Do what ``finding.action`` says and forget the marker."""
        if finding.verdict is Verdict.NOT_RESTORED:
            self._preserver.restore(InForce.from_marker(finding.marker), finding.marker)
        else:
            self._desk.clear(finding.marker)

    def forget(self, marker: Marker) -> None:
        """Forget a marker on a person's word alone."""
        self._desk.clear(marker)

    def _examine_write(self, marker: Marker) -> Finding:
        tool = int(str(marker.details["tool"]))
        now = self._tools.read(tool)
        requested = _offset(marker.details.get("requested"))
        before = _offset(marker.details.get("before"))
        if same_tool(now, requested):
            verdict = Verdict.DONE
            sentence = tr("Tool {tool} holds the new value {now}.", tool=tool, now=describe(now))
        elif same_tool(now, before):
            verdict = Verdict.NOT_APPLIED
            sentence = tr(
                "Tool {tool} still holds the old value {now}; the write did not take.",
                tool=tool,
                now=describe(now),
            )
        else:
            verdict = Verdict.CONFLICT
            sentence = tr(
                "Tool {tool} holds {now}: neither the old value {before} nor the new one "
                "{requested}.",
                tool=tool,
                now=describe(now),
                before=describe(before),
                requested=describe(requested),
            )
        return Finding(marker, verdict, sentence)

    def _examine_select(self, marker: Marker) -> Finding:
        now, wanted = self._tools.selected(), int(str(marker.details["select"]))
        verdict = Verdict.DONE if now == wanted else Verdict.NOT_APPLIED
        return Finding(marker, verdict, tr("Tool {now} is selected now.", now=now))

    def _examine_move(self, marker: Marker) -> Finding:
        pose = self._group.pose()
        sentence = tr(
            "The robot stands still at X {x} Y {y} Z {z} U {u} (tool {tool}); the move went to "
            "{target}. Look at it: nothing is sent again.",
            x=spel.decimal(pose.x_mm),
            y=spel.decimal(pose.y_mm),
            z=spel.decimal(pose.z_mm),
            u=spel.decimal(pose.u_deg),
            tool=pose.tool,
            target=marker.request,
        )
        return Finding(marker, Verdict.LOOK, sentence)

    def _examine_selection(self, marker: Marker) -> Finding:
        before, now = InForce.from_marker(marker), self._tools.selected()
        unverified = _written_in(marker)
        if now == before.tool and self._group.settings.read() == before.settings:
            sentence = tr("Tool {tool} is selected, as it was before.", tool=now)
            return Finding(marker, Verdict.DONE, f"{sentence} {unverified}".rstrip())
        sentence = tr(
            "Tool {now} is selected; before {reason!r} it was tool {before}.",
            now=now,
            reason=marker.request,
            before=before.tool,
        )
        return Finding(
            marker,
            Verdict.NOT_RESTORED,
            f"{sentence} {unverified}".rstrip(),
            tr("select tool {tool} again, with the power mode and speed of then", tool=before.tool),
        )


def _written_in(marker: Marker) -> str:
    """Say which tools were written in a procedure that nobody saw end well."""
    written = marker.details.get("written")
    if not isinstance(written, dict):
        return ""
    return " ".join(
        tr(
            "Tool {tool} was written meanwhile and not verified; before it held {before}.",
            tool=tool,
            before=describe(_offset(before)),
        )
        for tool, before in written.items()
    )


def _offset(value: object) -> ToolOffset | None:
    return ToolOffset(*value) if isinstance(value, list) else None
