"""Finishes or undoes interrupted jobs: tools written or selected, and movements."""

from robolink.controllers.driver_link import DriverLink, DriverPart
from robolink.controllers.preserving import Preserver
from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.model import (
    EntryKind,
    Finding,
    Marker,
    MarkerKind,
    NewEntry,
    ToolOffset,
    ToolTable,
    Verdict,
    describe_offset,
    plain_offset,
    put_right,
    read_for_verdict,
    read_offset,
)
from robolink.remedy_words import RemedyWord, remedy_word
from robolink.timing import local_label

_KINDS = {
    Verdict.DONE: EntryKind.DONE,
    Verdict.NOT_APPLIED: EntryKind.NOT_APPLIED,
    Verdict.CONFLICT: EntryKind.CONFLICT,
}


def examine_write(tools: ToolTable, marker: Marker) -> Finding:
    """Return what happened to a write.

    Raises:
        ConfigError: The marker cannot be understood.
    """
    tool = int(str(marker.details["tool"]))
    requested = read_offset(marker.details.get("requested"))
    before = read_offset(marker.details.get("before"))
    now = read_for_verdict(tools, tool, (before, requested))
    if tools.same(now, requested):
        verdict = Verdict.DONE
        sentence = tr("Tool {tool} holds the new value {now}.", tool=tool, now=describe_offset(now))
    elif tools.same(now, before):
        verdict = Verdict.NOT_APPLIED
        sentence = tr(
            "Tool {tool} still holds the old value {now}; the write did not take effect.",
            tool=tool,
            now=describe_offset(now),
        )
    else:
        verdict = Verdict.CONFLICT
        sentence = tr(
            "Tool {tool} holds {now}, neither the old value {before} nor the new one {requested}.",
            tool=tool,
            now=describe_offset(now),
            before=describe_offset(before),
            requested=describe_offset(requested),
        )
        sentence = f"{sentence} {put_right(now)}".rstrip()
    return Finding(marker, verdict, sentence, entries=(_entry(marker, tool, verdict, now),))


def examine_select(tools: ToolTable, marker: Marker) -> Finding:
    """Return what happened to one selection."""
    now, wanted = tools.selected(), int(str(marker.details["select"]))
    verdict = Verdict.DONE if now == wanted else Verdict.NOT_APPLIED
    return Finding(marker, verdict, tr("Tool {tool} is selected now.", tool=now))


def examine_move(marker: Marker) -> Finding:
    """Return what is known of a movement; whether it is as it should be, a person checks.

    How far it is from its target is not told: the tool in which that was meant may hold another
    value by now, or not be the selected one.
    """
    sentence = tr("It may have ended early. Look at the robot; nothing is sent again.")
    return Finding(marker, Verdict.LOOK, sentence)


def _entry(marker: Marker, tool: int, verdict: Verdict, now: ToolOffset | None) -> NewEntry:
    details = {**marker.details, "value": plain_offset(now), "found_later": True}
    kind = _KINDS[verdict]
    if kind is EntryKind.DONE and marker.details.get("part"):
        # The change that this write belongs to is finished or undone afterwards.
        kind = EntryKind.READ_BACK
    return NewEntry(kind, operation=marker.operation, tool=tool, verdict=verdict, details=details)


class MarkerResolver(DriverPart):
    """Recovers what an earlier process left open: by reading, and by asking a person.

    Nothing is sent again. A value that was being written is read; a robot that was told to move is
    looked at; the cell's own tool is selected again when a person says so. A kind of controller
    adds what else it marks.

    Args:
        link: The controller.
        tools: Its tools.
        preserver: Puts back what procedures have changed.

    Example:
        >>> from robolink.controllers import MarkerResolver, Preserver
        >>> from robolink.journal import memory_journal
        >>> from robolink.model import MarkerKind
        >>> from robolink.controllers import SimpleController, SimpleMachine
        >>> from robolink.controllers.simple_controller import SimpleLink
        >>> from robolink.timing import SystemClock
        >>> machine, url = SimpleMachine(), "acme+usb://resolver-example"
        >>> link = SimpleLink(machine, url, memory_journal(url).log(url), SystemClock())
        >>> tools = SimpleController(machine).tools
        >>> resolver = MarkerResolver(link, tools, Preserver(link, tools))
        >>> left = link.markers.begin(MarkerKind.MOVE, "Go to P1", {})
        >>> resolver.examine(left).verdict.name
        'LOOK'
    """

    def __init__(self, link: DriverLink, tools: ToolTable, preserver: Preserver) -> None:
        super().__init__(link)
        self._tools = tools
        self._preserver = preserver

    def fence(self) -> None:
        """See :meth:`robolink.model.Resolver.fence`.

        Nothing here: a controller that serves one client at a time, in the order in which it is
        asked, has served what came before when it answers the next one.
        """

    def examine(self, marker: Marker) -> Finding:
        """Read what is needed to judge ``marker``; see :class:`robolink.model.Resolver`."""
        if marker.kind is MarkerKind.MOVE:
            self._require_rest()
            return examine_move(marker)
        if marker.kind is MarkerKind.SELECTION:
            return self._preserver.examine(marker)
        if "select" in marker.details:
            return examine_select(self._tools, marker)
        finding = self._examine_more(marker)
        if finding is not None:
            return finding
        if "tool" in marker.details:
            return examine_write(self._tools, marker)
        raise ConfigError(
            tr(
                "The record of an unfinished job of {when} cannot be read.",
                when=local_label(marker.begun_at),
            ),
            remedy=tr(
                "Check the controller, then {forget}.",
                forget=remedy_word(RemedyWord.FORGET_MARKER),
            ),
        )

    def settle(self, finding: Finding) -> None:
        """Do what ``finding.action`` says and remove the marker."""
        if finding.verdict is Verdict.NOT_RESTORED:
            self.fence()  # the selected tool is read again behind this fence
            self._preserver.restore(finding.marker)
        else:
            self._driver.markers.clear(finding.marker, *finding.entries)

    def _require_rest(self) -> None:
        """Refuse to judge a movement while the machine moves."""

    def _examine_more(self, marker: Marker) -> Finding | None:
        """Judge what only this kind of controller marks; ``None`` for anything else."""
        return None
