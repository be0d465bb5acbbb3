"""Compare-and-set of a tool offset: the same for every kind of controller.

Source: docs/reference/rules.md 2.

Read; equal to what is wanted: nothing is written, because a write wears the controller's
memory; not what was expected, or farther than the cell allows: nothing is written either; else a
durable intent, one write, and a read-back of all six components, again where it differs. What
became of it goes on record together with the end of the intent.
"""

from abc import abstractmethod
from collections.abc import Callable, Iterator, Mapping
from typing import Final

from robolink.controllers.driver_link import DriverLink, MarkedCommand
from robolink.errors import ReadBackError
from robolink.messages import tr
from robolink.model import (
    ANY,
    EntryKind,
    Expected,
    Marker,
    NewEntry,
    ToolOffset,
    ToolReceipt,
    describe_offset,
    plain_offset,
    require_engineer,
    tool_changed,
)

Same = Callable[[ToolOffset | None, ToolOffset | None], bool]

_MORE_READINGS: Final = 2
"""Number of further readings if the first is neither the written value nor, in doubt, the old one.
"""


class ToolWrite(MarkedCommand[ToolOffset | None]):
    """One write of a tool; each kind of controller says how to read and send it.

    Attributes:
        tool: Number of the tool.
        requested: The new value as the controller can hold it; ``None`` clears the tool.
        before: What it held, once :meth:`change` has read it.

    Args:
        link: The controller.
        tool: Number of the tool.
        requested: The new value as the controller can hold it; ``None`` clears the tool.
        request: What is sent, as a person may read it.
        same: Whether the controller stores two values alike.

    Example:
        >>> from robolink import ToolOffset
        >>> from robolink.controllers import ToolWrite
        >>> from robolink.journal import memory_journal
        >>> from robolink.controllers import SimpleMachine
        >>> from robolink.controllers.simple_controller import SimpleLink
        >>> from robolink.timing import SystemClock
        >>> machine, url = SimpleMachine(), "acme+usb://write-example"
        >>> class AcmeWrite(ToolWrite):
        ...     def read_before(self, expected):
        ...         return self.read_back()
        ...     def send(self):
        ...         machine.store(self.tool, self.requested)
        ...     def read_back(self):
        ...         return machine.read(self.tool)
        >>> link = SimpleLink(machine, url, memory_journal(url).log(url), SystemClock())
        >>> write = AcmeWrite(link, 2, ToolOffset(5, 6, -70), "TOOL 2", same=lambda a, b: a == b)
        >>> write.change(expected=None).before, machine.read(2).z_mm
        (None, -70)
    """

    def __init__(
        self, link: DriverLink, tool: int, requested: ToolOffset | None, request: str, *, same: Same
    ) -> None:
        super().__init__(request)
        self.tool = tool
        self.requested = requested
        self.before: ToolOffset | None = None
        self._link = link
        self._same = same
        self._unconditional = False

    @abstractmethod
    def read_before(self, expected: Expected) -> ToolOffset | None:
        """Read what the write replaces; ``expected`` is what the caller believes that is."""

    @abstractmethod
    def read_back(self) -> ToolOffset | None:
        """Read what is stored after the controller has accepted the write."""

    def read_doubted(self) -> ToolOffset | None:
        """Read what is stored after an unclear answer."""
        return self.read_back()

    def change(self, expected: Expected) -> ToolReceipt:
        """Write and read back, while no other procedure runs; see the model.

        Raises:
            BusyError: Another thread is at work on this controller.
            StoppedError: A stop is active, or came meanwhile.
            RobolinkError: As :meth:`robolink.model.ToolTable.write`.
        """
        with self._link.lock.held(self.request):
            markers, self._unconditional = self._link.markers, expected is ANY
            if self._unconditional:
                purpose = tr("write tool {tool} without comparing its old value", tool=self.tool)
                require_engineer(markers.outcomes, purpose)
            markers.look()
            self.before = self.read_before(expected)
            markers.ledger.saw_tool(self.tool, self.before)
            if self._same(self.before, self.requested):
                self._link.decided("not written: it holds that value already", self.request)
                return self._receipt(self.before, skipped=True)
            if expected is not ANY and not self._same(self.before, expected):
                raise tool_changed(self.tool, self.before, expected)
            self._link.change_guard.require(self.tool, self.before, self.requested)
            self._require_clearer()
            found = self._link.carry_out(self)
            if not self._same(found, self.requested):
                raise self._differs(found)
            self._link.decided(f"verified: tool {self.tool} reads back as written", self.request)
            return self._receipt(found)

    def _require_clearer(self) -> None:
        """Let only an engineer clear a tool, unless that restores it."""
        if self.requested is None and not self._link.latch.restores:
            require_engineer(self._link.markers.outcomes, tr("clear tool {tool}", tool=self.tool))

    @property
    def details(self) -> Mapping[str, object]:
        """Plain JSON values needed to recover it later."""
        markers = self._link.markers
        details: dict[str, object] = {
            "tool": self.tool,
            "before": plain_offset(self.before),
            "requested": plain_offset(self.requested),
        }
        if self._unconditional:
            details["unconditional"] = True
        if markers.outcomes.change:
            details["change"] = markers.outcomes.change
        if markers.changing:
            details["part"] = True
        return details

    def read(self) -> ToolOffset | None:
        """Read what it changes; a value that it cannot have left counts when it is read twice.

        Two characters that change places on a serial line leave the sum over the answer as it is.
        """
        read = self.read_back if self.acknowledged else self.read_doubted
        found = read()
        for _ in range(_MORE_READINGS):
            if self._same(found, self.requested):
                break
            if not self.acknowledged and self._same(found, self.before):
                break
            last, found = found, read()
            if self._same(found, last):
                break
        return found

    def entries(self, marker: Marker, found: ToolOffset | None) -> Iterator[NewEntry]:
        """Return what is recorded together with the end of the marker."""
        now = {**marker.details, "value": plain_offset(found)}
        for kind in self._ends(found):
            said = {"request": self.request} if kind is EntryKind.WRITE else now
            yield NewEntry(kind, operation=marker.operation, tool=self.tool, details=said)

    def told_by(self, found: ToolOffset | None) -> str:
        """Return what the value read shows about an unclear answer."""
        if self._same(found, self.requested):
            return tr("Reading tool {tool} back confirms that it ran.", tool=self.tool)
        if self._same(found, self.before):
            return tr("Reading tool {tool} back shows that it did not run.", tool=self.tool)
        return tr(
            "Tool {tool} reads back as {found}.", tool=self.tool, found=describe_offset(found)
        )

    def _ends(self, found: ToolOffset | None) -> Iterator[EntryKind]:
        if not self.acknowledged and self._same(found, self.before):
            yield EntryKind.NOT_APPLIED
            return
        yield EntryKind.WRITE
        yield EntryKind.READ_BACK
        if not self._same(found, self.requested):
            yield EntryKind.CONFLICT
        elif self.acknowledged and not self._link.markers.changing:
            # A change of several steps records itself, at its end, if it is done.
            yield EntryKind.DONE

    def _receipt(self, found: ToolOffset | None, *, skipped: bool = False) -> ToolReceipt:
        return ToolReceipt(
            self.tool,
            self.before,
            self.requested,
            found,
            skipped=skipped,
            unconditional=self._unconditional,
        )

    def _differs(self, found: ToolOffset | None) -> ReadBackError:
        return ReadBackError(
            tr(
                "Tool {tool} was written {requested}, but reads back as {found}.",
                tool=self.tool,
                requested=describe_offset(self.requested),
                found=describe_offset(found),
            ),
            remedy=tr(
                "Do not use it. It held {before} before.",
                before=describe_offset(self.before),
            ),
        )
