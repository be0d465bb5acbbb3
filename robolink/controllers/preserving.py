"""Restores at the end of a procedure what was set before, whatever that end is.

A calibration works in Tool 0, and the selection of an EPSON controller survives power-off
(docs/reference/epson.md 3.1): left there, the next program would drive the flange where the nozzle
tip belongs. So a durable marker names the cell's own tool before anything is changed, and goes only
when that tool has been read back (docs/reference/rules.md 4).
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager

from robolink.controllers.driver_link import DriverLink
from robolink.errors import ConfigError, JournalError, RobolinkError
from robolink.messages import tr
from robolink.model import (
    EntryKind,
    Finding,
    Marker,
    MarkerKind,
    MotionGroup,
    NewEntry,
    ToolTable,
    Verdict,
)
from robolink.remedy_words import RemedyWord, remedy_word
from robolink.timing import local_label


class Preserver:
    """Remembers the selected tool at the start of a procedure, and restores it at the end.

    A kind of controller on which more has to be restored adds that.

    Args:
        link: The controller.
        tools: Its tools.
        groups: What moves.

    Example:
        >>> from robolink import ToolOffset
        >>> from robolink.controllers import Preserver
        >>> from robolink.journal import memory_journal
        >>> from robolink.controllers import SimpleController, SimpleMachine
        >>> from robolink.controllers.simple_controller import SimpleLink
        >>> from robolink.timing import SystemClock
        >>> machine, url = SimpleMachine({1: ToolOffset(12)}, selected=1), "acme+usb://arm"
        >>> link = SimpleLink(machine, url, memory_journal(url).log(url), SystemClock())
        >>> tools = SimpleController(machine).tools
        >>> with Preserver(link, tools).preserved("a trial"):
        ...     tools.select(0)
        >>> tools.selected()
        1
    """

    def __init__(
        self, link: DriverLink, tools: ToolTable, groups: Sequence[MotionGroup] = ()
    ) -> None:
        self._link = link
        self._tools = tools
        self._groups = groups

    @contextmanager
    def preserved(self, reason: str) -> Iterator[None]:
        """See :meth:`robolink.model.Controller.preserved`."""
        markers = self._link.markers
        lock = self._link.lock
        with lock.held(reason), lock.patience.between(), markers.ledger.block():
            markers.look()
            # Checked before a person starts a measurement that would be refused later, even if no
            # tool is reported.
            markers.require_settled(reason)
            details = self._in_force(reason)
            if details is None:
                yield
                return
            marker: Marker | None = None
            try:
                with self._link.uninterrupted():
                    marker = markers.begin(MarkerKind.SELECTION, reason, details)
                with self._link.signs_of_life.shown():
                    yield
            except BaseException as error:
                if marker is not None:
                    self._restore_after(error, marker)
                raise
            self.restore(marker)

    def restore(self, marker: Marker) -> None:
        """Restore what ``marker`` names, and remove it; Ctrl-C waits for the end.

        Raises:
            ConfigError: The marker was written by something else.
            RobolinkError: It is not back; the marker stays.
        """
        tool = tool_before(marker)
        with self._link.uninterrupted(), self._link.latch.restoring():
            for group in self._groups:
                group.abort_unfinished()
            self._tools.select(tool)
            self._restore_more(marker)
            self._link.markers.clear(marker)

    def examine(self, marker: Marker) -> Finding:
        """Return whether a procedure that ended early has restored everything; only reads."""
        before, now = tool_before(marker), self._tools.selected()
        return _judged(
            marker,
            now=now,
            before=before,
            restored=now == before and self._restored_more(marker),
            action=self._action(marker, now),
        )

    def _in_force(self, reason: str) -> Mapping[str, object] | None:
        """Read what to restore, as plain JSON; ``None`` if nothing is ever changed."""
        tool = self._tools.selected()
        # A controller that does not report the selected tool cannot select one either.
        return None if tool is None else {"tool": tool, "now": tool}

    def _restore_more(self, marker: Marker) -> None:
        """Restore what this kind of controller has besides the tool."""

    def _restored_more(self, marker: Marker) -> bool:
        """Whether that is restored."""
        return True

    def _action(self, marker: Marker, now: int | None) -> str:
        """Return what :meth:`restore` would do, without a full stop."""
        return tr("Select tool {tool} again", tool=tool_before(marker))

    def _restore_after(self, error: BaseException, marker: Marker) -> None:
        """Restore while ``error`` is raised; if impossible, add to it what is left."""
        try:
            self.restore(marker)
        except RobolinkError as second:
            if isinstance(error, RobolinkError):
                error.say_what_stands(_unrestored(second, tool_before(marker)))


def tool_before(marker: Marker) -> int:
    """Return the tool that was selected when a procedure began.

    Raises:
        ConfigError: The marker was written by something else.
    """
    tool = marker.details.get("tool")
    if not isinstance(tool, int):
        raise not_understood(marker)
    return tool


def not_understood(marker: Marker) -> ConfigError:
    """Return the error for a procedure's marker that something else has written."""
    return ConfigError(
        tr(
            "The record of an unfinished job of {when} cannot be read.",
            when=local_label(marker.begun_at),
        ),
        remedy=tr(
            "Select the right tool by hand, then {forget}.",
            forget=remedy_word(RemedyWord.FORGET_MARKER),
        ),
    )


def _unrestored(failure: RobolinkError, tool: int) -> str:
    """Return the sentence about an earlier tool that a procedure meant to leave selected.

    Args:
        failure: What kept the end of the procedure from being recorded, or from happening.
        tool: Its number.
    """
    if isinstance(failure, JournalError):
        return tr(
            "Tool {tool} is selected again, but this could not be recorded: {cause} Next: "
            "'robolink recover'.",
            tool=tool,
            cause=failure.what,
        )
    return tr(
        "robolink could not select the previous tool {tool} again: {cause} 'robolink "
        "recover' selects it.",
        tool=tool,
        cause=failure.what,
    )


def _judged(
    marker: Marker, *, now: int | None, before: int, restored: bool, action: str
) -> Finding:
    """Return whether a procedure that ended early has restored the cell's own tool.

    Args:
        marker: Of the procedure.
        now: The tool that is selected.
        before: The tool that was selected when the procedure began.
        restored: Whether all is as it was then.
        action: What settling would do about it, without a full stop.
    """
    if restored:
        sentence = tr("Tool {tool} is selected, as before.", tool=now)
        return Finding(marker, Verdict.DONE, sentence)
    if now == before:
        sentence = tr(
            "Tool {tool} is selected, as before; the power mode, speed or acceleration has "
            "changed.",
            tool=now,
        )
    else:
        sentence = tr(
            "Tool {now} is selected now; it was tool {tool} before.", now=now, tool=before
        )
    entry = NewEntry(EntryKind.SELECTION, tool=before, verdict=Verdict.NOT_RESTORED)
    return Finding(marker, Verdict.NOT_RESTORED, sentence, action, (entry,))
