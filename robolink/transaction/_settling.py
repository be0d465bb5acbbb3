"""Recovers open markers: those of the driver, and those of whole changes.

It reads, settles what reading can settle, and asks for the rest. It may be killed at any point and
run again: each step looks at the controller anew, a tool that holds its old value is never written,
and so one write per tool is the most that ever takes effect.
"""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, Final

from robolink.errors import (
    ConfigError,
    JournalError,
    NotReadyError,
    NotReadyReason,
    OutcomeUnknownError,
    RobolinkError,
)
from robolink.messages import in_english, joined, listed, tr
from robolink.model import (
    Controller,
    EntryKind,
    Finding,
    Marker,
    MarkerKind,
    NewEntry,
    ToolOffset,
    Verdict,
    describe_offset,
    plain_offset,
    put_right,
    read_for_verdict,
    read_offset,
)
from robolink.package_log import PackageLog
from robolink.remedy_words import RemedyWord, remedy_word
from robolink.timing import local_label
from robolink.transaction._orders import forgotten, kept_later, order_of
from robolink.transaction._put_back import Step, put_back

_LOG: Final = PackageLog(__package__)


class Settler:
    """Examines and recovers what was left open on one controller.

    What is settled was read behind a fence: no request of before can change it afterwards
    (docs/reference/rules.md 1).

    Args:
        controller: The controller, connected.
        keep: Whether new values that nobody verified stay, because a person says so.
        only_looks: Whether nothing is to be settled, so that nothing is sent but questions.

    Example:
        >>> import robolink
        >>> from robolink.model import MarkerKind
        >>> from robolink.transaction import Settler
        >>> with robolink.connect("epson+sim://settler-example") as controller:
        ...     marker = controller.begin(MarkerKind.SET, "TLSet 2", {"tool": 2})
        ...     settler = Settler(controller)
        ...     settler.settle(settler.examine(marker))
        ...     controller.outcomes.open_markers()
        ()
    """

    def __init__(
        self, controller: Controller, *, keep: bool = False, only_looks: bool = False
    ) -> None:
        self._controller = controller
        self._keep = keep
        self._only_looks = only_looks

    def examine(self, marker: Marker) -> Finding:
        """Read what is needed to judge ``marker``; changes no tool.

        Raises:
            ConfigError: The marker was written by something else.
            NotReadyError: It is about a robot that is not in force.
            LeaseHeldError: Another client has the controller, so nothing may be settled.
        """
        if not self._only_looks:
            self._controller.resolver.fence()
        if marker.kind is MarkerKind.HISTORY:
            return self._without_record(marker)
        self._require_robot(marker)
        if marker.kind is not MarkerKind.CHANGE:
            return self._controller.resolver.examine(marker)
        tools = self._controller.tools
        steps = _steps(marker)
        now = {
            step.tool: read_for_verdict(tools, step.tool, (step.before, step.requested))
            for step in steps
        }
        new = [tools.same(now[step.tool], step.requested) for step in steps]
        old = [tools.same(now[step.tool], step.before) for step in steps]
        sentence = joined(
            " ",
            [
                tr("Tool {tool} holds {now}.", tool=step.tool, now=describe_offset(now[step.tool]))
                for step in steps
            ],
        )
        if not all(n or o for n, o in zip(new, old, strict=True)):
            return self._conflict(marker, steps, now)
        if all(old):
            text = tr("{holds} Nothing of the change took effect.", holds=sentence)
            return _finding(marker, Verdict.NOT_APPLIED, text, steps, now)
        if all(new) and (self._keep or not marker.details.get("verify")):
            text = tr("{holds} The change is complete.", holds=sentence)
            done = _finding(marker, Verdict.DONE, text, steps, now)
            return replace(done, entries=(*done.entries, *kept_later(marker, now)))
        if all(new):
            text = tr("{holds} Written, but never tested.", holds=sentence)
        else:
            text = tr("{holds} Written, but the change is not complete.", holds=sentence)
        numbers = ", ".join(
            str(step.tool) for step, is_old in zip(steps, old, strict=True) if not is_old
        )
        action = tr("Restore the old value of tool {numbers}", numbers=numbers)
        return Finding(marker, Verdict.NOT_FINISHED, text, action)

    def settle(self, finding: Finding) -> None:
        """Do what ``finding.action`` says and remove the marker.

        Raises:
            RobolinkError: It could not be done; the marker stays.
        """
        outcomes = self._controller.outcomes
        _LOG.decided(
            f"recovered: {finding.verdict}, {in_english(finding.sentence)}",
            controller=self._controller.identity,
            request=finding.marker.request,
        )
        outcomes.change = str(finding.marker.details.get("change", ""))
        outcomes.order = order_of(finding.marker)
        try:
            if finding.marker.kind is MarkerKind.HISTORY:
                self._controller.finish(finding.marker, *finding.entries)
            elif finding.marker.kind is not MarkerKind.CHANGE:
                self._controller.resolver.settle(finding)
            elif finding.verdict is not Verdict.NOT_FINISHED:
                self._controller.finish(finding.marker, *finding.entries)
            else:
                self._put_back(finding.marker)
        finally:
            outcomes.change = outcomes.order = ""

    def forget(self, marker: Marker) -> None:
        """Remove a marker because a person confirms it, without reading.

        Raises:
            LeaseHeldError: Another client has the controller.
        """
        self._controller.resolver.fence()
        self._controller.finish(
            marker,
            NewEntry(
                EntryKind.DECISION,
                operation=marker.operation,
                verdict=tr("dropped without a check"),
                details={"request": marker.request, **marker.details},
            ),
            *forgotten(marker),
        )

    def _require_robot(self, marker: Marker) -> None:
        """Refuse to judge by one robot's tools what was started on another robot."""
        begun_on, in_force = marker.details.get("robot"), self._controller.outcomes.robot
        if begun_on and begun_on != in_force:
            raise NotReadyError(
                tr(
                    "{request!r} was begun on {robot}; {other} is selected now.",
                    request=marker.request,
                    robot=begun_on,
                    other=in_force or self._controller.outcomes.identity,
                ),
                reason=NotReadyReason.OTHER_ROBOT,
                remedy=tr("Choose that robot on the controller, then run 'robolink recover'."),
                controller=self._controller.identity,
            )

    def _put_back(self, marker: Marker) -> None:
        self._controller.begin(
            marker.kind, marker.request, marker.details, operation=marker.operation
        )
        selected = marker.details.get("selected")
        done = put_back(
            self._controller,
            _steps(marker),
            selected=selected if isinstance(selected, int) else None,
        )
        failures = [result for result in done if not result.restored]
        entries = [result.entry for result in done]
        if not failures:
            self._controller.finish(marker, *entries)
            return
        self._controller.outcomes.append(*entries)
        raise OutcomeUnknownError(
            listed(
                tr("{count} tools could not be restored:", count=len(failures))
                if len(failures) > 1
                else tr("A tool could not be restored:"),
                [result.sentence for result in failures],
            ),
            remedy=tr(
                "The change stays open. Look at the controller. Values: robolink journal list"
            ),
            controller=self._controller.identity,
        )

    def _without_record(self, marker: Marker) -> Finding:
        selected = self._controller.tools.selected()
        now = tr("unknown") if selected is None else str(selected)
        sentence = tr(
            "Tool {tool} is selected. Only you can say whether that is right for this cell "
            "and whether each tool has the right value: this PC has no record of "
            "unfinished jobs.",
            tool=now,
        )
        backup = marker.details.get("backup")
        if backup:
            sentence += " " + tr(
                "'robolink tool compare {path}' shows what has changed.", path=backup
            )
        entry = NewEntry(
            EntryKind.DECISION,
            verdict=tr("a person checked the controller and starts a new record"),
            details={**marker.details, "selected": selected},
        )
        return Finding(marker, Verdict.LOOK, sentence, entries=(entry,))

    def _conflict(
        self, marker: Marker, steps: list[Step], now: dict[int, ToolOffset | None]
    ) -> Finding:
        sentence = joined(
            " ",
            [
                tr(
                    "Tool {tool} holds {now}; before the change it was {before}, it was to be "
                    "{requested}.",
                    tool=step.tool,
                    now=describe_offset(now[step.tool]),
                    before=describe_offset(step.before),
                    requested=describe_offset(step.requested),
                )
                for step in steps
            ],
        )
        ways = {put_right(offset) for offset in now.values()}
        sentence = joined(" ", (sentence, *filter(None, ways)))
        return _finding(marker, Verdict.CONFLICT, sentence, steps, now)


_KINDS = {
    Verdict.DONE: EntryKind.DONE,
    Verdict.NOT_APPLIED: EntryKind.NOT_APPLIED,
    Verdict.CONFLICT: EntryKind.CONFLICT,
}


def _finding(
    marker: Marker,
    verdict: Verdict,
    sentence: str,
    steps: list[Step],
    now: dict[int, ToolOffset | None],
) -> Finding:
    entries = tuple(
        NewEntry(
            _KINDS[verdict],
            operation=marker.operation,
            tool=step.tool,
            verdict=verdict,
            details={
                "before": plain_offset(step.before),
                "requested": plain_offset(step.requested),
                "value": plain_offset(now[step.tool]),
                "found_later": True,
            },
        )
        for step in steps
    )
    return Finding(marker, verdict, sentence, entries=entries)


def _steps(marker: Marker) -> list[Step]:
    tools = marker.details.get("tools")
    try:
        if not isinstance(tools, dict):
            raise TypeError
        return [
            Step(int(tool), read_offset(values["before"]), read_offset(values["requested"]))
            for tool, values in tools.items()
        ]
    except (KeyError, TypeError, ValueError) as error:
        raise ConfigError(
            tr(
                "The record of an unfinished job of {when} cannot be read.",
                when=local_label(marker.begun_at),
            ),
            remedy=tr(
                "Compare the tools with a backup, then {forget}.",
                forget=remedy_word(RemedyWord.FORGET_MARKER),
            ),
        ) from error


_ORDER = (
    MarkerKind.SET,
    MarkerKind.CHANGE,
    MarkerKind.SELECTION,
    MarkerKind.MOVE,
    MarkerKind.HISTORY,
)
"""Order of judging: what was in flight comes before the change around it. Only a person can judge a
movement, by looking at the cell when its own tool is selected again."""


@dataclass(frozen=True, slots=True)
class Recovery:
    """What a recovery found and did.

    Attributes:
        settled: What is closed now.
        left: What takes a person's word, and did not get it.
    """

    json_version: ClassVar[int] = 5
    settled: tuple[Finding, ...]
    left: tuple[Finding, ...]


def recover(
    controller: Controller,
    *,
    keep: bool = False,
    confirm: Callable[[Finding], bool] = lambda _finding: False,
    tell: Callable[[Finding, bool], None] = lambda _finding, _settled: None,
    later: Collection[str] = (),
) -> Recovery:
    """Finish or undo an interrupted job: by reading, and by asking a person.

    Nothing that moved or was written is sent again. What was sent and not answered is fenced off
    first, so that nothing arrives behind the look that settles it; on a PLC that takes the
    mailbox, and may take the ten seconds for which a dead process keeps it.

    Args:
        controller: The controller, connected.
        keep: Whether new values that nobody verified stay.
        confirm: Asked about each finding that reading cannot settle; true where a person has
            looked and work may go on.
        tell: Told of each finding, and whether it is settled. A command that was part of a change
            or a procedure is told of with that, not by itself.
        later: Operations of markers that are left alone: the caller settles them.

    Raises:
        BusyError: Somebody else is changing this controller just now.
        LeaseHeldError: Another program commands the PLC; nothing is settled.
        RobolinkError: A step failed; the rest stays open.

    Example:
        >>> import robolink
        >>> from robolink.transaction import recover
        >>> with robolink.connect("epson+sim://recover-example") as controller:
        ...     print(recover(controller).left)
        ()
    """
    request = tr("recover")
    with (
        controller.procedure(request),
        controller.outcomes.hold(request),
        controller.signs_of_life(),
    ):
        markers = [
            marker
            for marker in _in_order(controller.outcomes.open_markers())
            if marker.operation not in later
        ]
        if markers:
            requests = [marker.request for marker in markers]
            controller.outcomes.append(
                NewEntry(EntryKind.RECONNECT, details={"unsettled": requests})
            )
        return _Recovering(Settler(controller, keep=keep), markers, confirm, tell).run()


def look(
    controller: Controller,
    *,
    keep: bool = False,
    tell: Callable[[Finding], None] = lambda _finding: None,
) -> tuple[Finding, ...]:
    """Return what :func:`recover` would find, and report what it would; reads only.

    Args:
        controller: The controller, connected.
        keep: Whether new values that nobody verified would stay.
        tell: Told of each finding.

    Example:
        >>> import robolink
        >>> from robolink.transaction import look
        >>> with robolink.connect("epson+sim://look-example") as controller:
        ...     look(controller)
        ()
    """
    settler = Settler(controller, keep=keep, only_looks=True)
    markers = _in_order(controller.outcomes.open_markers())
    findings = tuple(_examined(settler, marker) for marker in markers)
    for finding in findings:
        if _told_with(finding.marker, markers) is None:
            tell(finding)
    return findings


def _in_order(markers: Sequence[Marker]) -> list[Marker]:
    """Return markers in the order of their recovery."""
    return sorted(markers, key=lambda marker: _ORDER.index(marker.kind))


def _told_with(marker: Marker, others: Sequence[Marker]) -> Marker | None:
    """Return the open change or procedure that a command was part of, ``None`` for none.

    What was found out about the command is overtaken by what becomes of the whole: a tool that
    holds the new value, and a moment later the old one again.
    """
    if marker.kind is not MarkerKind.SET:
        return None
    for other in others:
        if other.kind is MarkerKind.CHANGE and "tool" in marker.details:
            change = other.details.get("change")
            if change and change == marker.details.get("change"):
                return other
        if other.kind is MarkerKind.SELECTION and "select" in marker.details:
            return other
    return None


class _Recovering:
    """One recovery, marker by marker."""

    def __init__(
        self,
        settler: Settler,
        markers: Sequence[Marker],
        confirm: Callable[[Finding], bool],
        tell: Callable[[Finding, bool], None],
    ) -> None:
        self._settler = settler
        self._markers = markers
        self._confirm = confirm
        self._tell = tell
        self._settled: list[Finding] = []
        self._left: list[Finding] = []
        self._waiting: list[tuple[Marker, Finding]] = []

    def run(self) -> Recovery:
        for marker in self._markers:
            finding = _examined(self._settler, marker)
            whole = _told_with(marker, self._markers)
            if whole is not None and finding.verdict.needs_a_person:
                self._waiting.append((whole, finding))
                continue
            decided = not finding.verdict.needs_a_person or self._confirm(finding)
            self._end(finding, decided=decided)
            if whole is None:
                self._tell(finding, decided)
            for part in [part for of, part in self._waiting if of is marker]:
                self._end(part, decided=decided)
        return Recovery(tuple(self._settled), tuple(self._left))

    def _end(self, finding: Finding, *, decided: bool) -> None:
        if not decided:
            self._left.append(finding)
            return
        try:
            self._settler.settle(finding)
        except RobolinkError as error:
            error.advise(tr("You can run 'robolink recover' again."))
            raise
        self._settled.append(finding)


def _examined(settler: Settler, marker: Marker) -> Finding:
    try:
        return settler.examine(marker)
    except JournalError:
        raise
    except ConfigError as error:
        # Written by something else: a person checks and confirms that it can be dropped.
        return Finding(marker, Verdict.LOOK, error.what)
