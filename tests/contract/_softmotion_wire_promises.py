"""What was sent to a PLC and what was read from it, and the promises that this must keep.

The promises are those of docs/reference/rules.md 1, 2, 4 and 5, on the wire of the mailbox. They
name what has to be seen before and after each command, never how many exchanges that takes.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, Final
from unittest.mock import patch

from robolink.controllers.softmotion import controller as connecting
from robolink.model import Marker, MarkerKind, OutcomeLog
from robolink.protocols.mailbox import (
    Bits,
    BlockError,
    Command,
    CommandState,
    GroupState,
    Opcode,
    Response,
    Slot,
    decode_command,
    decode_response,
    decode_slot,
    frames_match,
)
from robolink.timing import NS_PER_S
from robolink.transport import LinkUrl, MailboxHead, MailboxLink, open_mailbox_link
from robolink.transport.word_traffic import MailboxLinkAround

MOVES: Final = (Opcode.MOVE_DIRECT, Opcode.MOVE_LINEAR, Opcode.MOVE_UNTIL_INPUT)
RIDES: Final = (*MOVES, Opcode.JOG)
ENDED: Final = (CommandState.DONE, CommandState.ABORTED, CommandState.ERROR)
SIGN_S: Final = 0.25
"""Longest time between two signs of life during a movement; the PLC bears 0.5 s."""
LOOK_S: Final = 0.5
"""Longest time between two looks at a movement."""
_TOLERANCE: Final = 1e-9


@dataclass(frozen=True)
class Passed:
    """One exchange, or one marker that was stored, in the order of their ends.

    Attributes:
        kind: ``command``, ``response``, ``slot``, ``head``, ``beat`` or ``marker``.
        at_ns: When, on the clock of the link.
        command: What was sent.
        now: What the response block showed.
        number: Of the slot that was read, or the word of a beat.
        slot: What the slot held.
        marker: The marker.
    """

    kind: str
    at_ns: int = 0
    command: Command = field(default_factory=lambda: Command(0, 0))
    now: Response = field(default_factory=Response)
    number: int = 0
    slot: Slot = field(default_factory=Slot)
    marker: Marker | None = None

    def of(self, *opcodes: Opcode) -> bool:
        """Whether it is a command of one of these."""
        return self.kind == "command" and self.command.opcode in opcodes


class TappedLink(MailboxLinkAround):
    """A link of which everything is noted that arrives whole."""

    def __init__(self, inner: MailboxLink, log: list[Passed]) -> None:
        super().__init__(inner)
        self._log = log

    def write_command(self, words: Sequence[int], admit: Callable[[], None] = lambda: None) -> None:
        """Note a command as it leaves."""

        def noted() -> None:
            admit()
            self._note("command", command=decode_command(words))

        self._inner.write_command(words, noted)

    def read_head(self) -> MailboxHead:
        """Note a look at the head."""
        head = self._inner.read_head()
        self._note("head")
        return head

    def read_response(self) -> tuple[int, ...]:
        """Note a snapshot."""
        words = self._inner.read_response()
        with suppress(BlockError):  # caught in the middle of a change, it counts for nothing
            self._note("response", now=decode_response(words))
        return words

    def read_slot(self, slot: int) -> tuple[int, ...]:
        """Note what a slot holds."""
        words = self._inner.read_slot(slot)
        with suppress(BlockError):
            self._note("slot", number=slot, slot=decode_slot(words))
        return words

    def read_device(self) -> tuple[int, ...]:
        """Pass it on."""
        return self._inner.read_device()

    def beat(self, word: int) -> None:
        """Note a beat."""
        self._note("beat", number=word)
        self._inner.beat(word)

    def reopened(self, *, timeout_s: float) -> MailboxLink:
        """Pass it on."""
        return self._inner.reopened(timeout_s=timeout_s)

    def _note(self, kind: str, **seen: Any) -> None:
        self._log.append(Passed(kind, self.clock.now_ns(), **seen))


@contextmanager
def tapped() -> Iterator[list[Passed]]:
    """Note what passes on every link to a mailbox that is opened meanwhile."""
    log: list[Passed] = []

    def tap(url: LinkUrl | str, **options: Any) -> MailboxLink:
        return TappedLink(open_mailbox_link(url, **options), log)

    with patch.object(connecting, "open_mailbox_link", tap):
        yield log


def note_markers(outcomes: OutcomeLog, log: list[Passed]) -> None:
    """Note every marker in the same log, once it is stored."""
    begin = outcomes.begin

    def noting(marker: Marker) -> None:
        begin(marker)
        log.append(Passed("marker", marker=marker))

    outcomes.begin = noting  # type: ignore[method-assign]


class WireLog:
    """One session, from its first exchange to its last.

    Args:
        passed: All of it, in order.
    """

    def __init__(self, passed: Sequence[Passed]) -> None:
        self._passed = [one for one in passed if one.kind != "beat"]
        self._signs = [one for one in passed if one.kind in ("beat", "command")]
        self._broken: list[str] = []
        self._at = 0

    def broken(self) -> list[str]:
        """Return every promise that is not kept, with the place."""
        for at, one in enumerate(self._passed):
            if one.kind == "command":
                self._at = at
                self._every_command(one.command)
                self._of_a_movement(one.command)
                self._of_a_selection(one.command)
                self._of_a_write(one.command)
        self._of_beats()
        self._of_the_end()
        return self._broken

    def _require(self, kept: object, promise: str) -> None:
        if not kept:
            command = self._passed[self._at].command
            self._broken.append(f"{self._at} {Opcode(command.opcode).name}: {promise}")

    # What was seen before and after.

    def _before(self, *, since: int = 0) -> list[Passed]:
        return self._passed[since : self._at]

    def _after(self, until: Callable[[Passed], bool]) -> list[Passed]:
        found = []
        for one in self._passed[self._at + 1 :]:
            if until(one):
                break
            found.append(one)
        return found

    @property
    def _look(self) -> Response | None:
        """The snapshot just before the block; nothing else of this client lies between."""
        last = self._passed[self._at - 1] if self._at else Passed("nothing")
        return last.now if last.kind == "response" else None

    def _last(self, *opcodes: Opcode) -> int:
        """Return where the last command of these is, before the present one; else -1."""
        places = [n for n, one in enumerate(self._before()) if one.of(*(opcodes or Opcode))]
        return places[-1] if places else -1

    def _commands(self) -> list[Command]:
        return [one.command for one in self._before() if one.kind == "command"]

    def _owned(self) -> tuple[int, int]:
        """Return who owns the mailbox under which epoch, as was read last."""
        for one in reversed(self._before()):
            answer = one.now.answer
            if one.kind == "response" and one.now.opcode_echo == Opcode.OWNERSHIP and answer.epoch:
                return answer.holder, answer.epoch
        return 0, 0

    # The promises.

    def _every_command(self, command: Command) -> None:
        look, earlier = self._look, self._commands()
        self._require(
            command.sequence not in [one.sequence for one in earlier], "no number is sent twice"
        )
        self._require({one.owner for one in earlier} <= {command.owner}, "one owner")
        if command.only_ends:
            return
        self._require(look is not None, "a snapshot just before it")
        if look is None:
            return
        self._require(look.boot_id == command.boot_id != 0, "the start of the PLC as just read")
        if command.needs_owner:
            self._require(look.bits & Bits.OWNED, "the mailbox is owned")
            self._require(
                self._owned() == (command.owner, command.epoch), "the owner and epoch as answered"
            )
        if command.needs_permit:
            self._require(look.bits & Bits.PERMITTED, "the machine permits it")
        if earlier:
            last = earlier[-1]
            acknowledged = any(
                one.kind == "response"
                and (one.now.ack_owner, one.now.ack_head, one.now.opcode_echo)
                == (last.owner, last.sequence, last.opcode)
                for one in self._before(since=self._last() + 1)
            )
            self._require(acknowledged, "the command before was acknowledged as ours")

    def _of_a_movement(self, command: Command) -> None:
        if command.opcode not in RIDES or command.only_ends:
            return
        look = self._look or Response()
        self._require(look.group_state == GroupState.STANDBY, "the group stands and is enabled")
        self._require(look.bits & Bits.POWERED, "the drives have power")
        self._require(not look.bits & (Bits.JOGGING | Bits.INTERRUPTED), "nothing else is begun")
        before = self._before(since=self._last() + 1)
        marked = [
            one.marker is not None and one.marker.kind is MarkerKind.MOVE
            for one in before
            if one.kind in ("marker", "response")
        ]
        self._require(True in marked, "a marker of its own")
        self._require(marked[-1:] == [False], "a snapshot after its marker")
        if command.opcode in MOVES:
            self._require(look.bits & Bits.TOOL_KNOWN, "the tool is the one that was set")
            self._require(look.tool_slot == self._selected(), "the tool that was selected")
        self._ends(command)

    def _ends(self, command: Command) -> None:
        """A movement is seen to end, and its group to rest, before the next command."""
        after = self._after(lambda one: one.kind == "command" and not one.command.only_ends)
        shown = [one.now for one in after if one.kind == "response"]
        ended = [n for n, now in enumerate(shown) if _ended(command, now)]
        self._require(ended, "its end is read")
        rest = [now.group_state != GroupState.MOVING for now in shown[ended[0] :]] if ended else []
        self._require(True in rest, "the rest of the group is read")
        looks = [one.at_ns for one in after if one.kind in ("head", "response")]
        until_ns = self._passed[self._at].at_ns
        if ended:
            until_ns = [one.at_ns for one in after if one.kind == "response"][ended[0]]
        # The end of a jog is sent, and from then on no beat keeps it going.
        until_ns = min([until_ns, *(one.at_ns for one in after if one.of(Opcode.JOG))])
        self._in_time(looks, until_ns, LOOK_S, "it is looked at in time")
        signs = [one.at_ns for one in self._signs]
        self._in_time(signs, until_ns, SIGN_S, "it is kept going in time")

    def _in_time(self, times: list[int], until_ns: int, most_s: float, promise: str) -> None:
        begun_ns = self._passed[self._at].at_ns
        within = [begun_ns, *(one for one in times if begun_ns < one < until_ns), until_ns]
        longest_s = max((b - a) / NS_PER_S for a, b in pairwise(within))
        self._require(longest_s <= most_s, f"{promise}: {longest_s:.3f} s")

    def _of_a_selection(self, command: Command) -> None:
        if command.opcode != Opcode.SELECT_TOOL:
            return
        slot = command.operands[0]
        read = self._read_before(slot)
        self._require(read is not None or not slot, "the slot is read before it is selected")
        self._require(self._is_marked(), "a marker of its own")
        after = self._after(lambda one: one.of(*RIDES, Opcode.WRITE_TOOL, Opcode.SELECT_TOOL))
        shown = [one.now.tool_slot for one in after if one.kind == "response"]
        self._require(slot in shown, "the selection is read back")
        self._group_works_with(after, read.tool if read else (0.0,) * 6)

    def _of_a_write(self, command: Command) -> None:
        if command.opcode not in (Opcode.WRITE_TOOL, Opcode.CLEAR_TOOL):
            return
        slot = command.operands[0]
        self._require(self._read_before(slot), "the slot is read before it is written")
        self._require(self._is_marked(), "a marker of its own")
        after = self._after(
            lambda one: one.kind == "command" and one.command.opcode != Opcode.READ_TOOL
        )
        back = [n for n, one in enumerate(after) if one.kind == "slot" and one.number == slot]
        self._require(back, "the slot is read back")
        if not back:
            return
        found = after[back[-1]].slot
        written = command.opcode == Opcode.WRITE_TOOL
        self._require(found.defined == written, "it holds something, or nothing, as written")
        if written:
            same = frames_match(found.tool, command.pose, tolerance=_TOLERANCE)
            self._require(same, "it holds what was written")
        behind = [one.kind for one in after[back[-1] + 1 :]]
        self._require("response" in behind, "the order of its words is proved behind the slot")
        look = self._look
        if written and look is not None and look.tool_slot == slot:
            self._group_works_with(after, command.pose)

    def _group_works_with(self, after: list[Passed], tool: Sequence[float]) -> None:
        asked = [n for n, one in enumerate(after) if one.of(Opcode.READ_TOOL)]
        answers = (
            [
                one.now.answer.pose
                for one in after[asked[0] :]
                if one.kind == "response"
                and one.now.opcode_echo == Opcode.READ_TOOL
                and one.now.ack_head == after[asked[0]].command.sequence
            ]
            if asked
            else []
        )
        same = answers and frames_match(answers[-1], tuple(tool), tolerance=_TOLERANCE)  # type: ignore[arg-type]
        self._require(same, "the group itself is read to work with it")

    def _read_before(self, slot: int) -> Slot | None:
        """Return what a slot was read to hold, behind the last command that changes slots."""
        last = self._last(Opcode.WRITE_TOOL, Opcode.CLEAR_TOOL)
        found = [
            one.slot
            for one in self._before(since=last + 1)
            if one.kind == "slot" and one.number == slot
        ]
        return found[-1] if found else None

    def _is_marked(self) -> bool:
        return any(
            one.marker is not None and one.marker.kind is MarkerKind.SET
            for one in self._before(since=self._last() + 1)
        )

    def _selected(self) -> int:
        """Return the tool that was selected last; at first, the one that was met."""
        for one in reversed(self._before()):
            if one.of(Opcode.SELECT_TOOL):
                return one.command.operands[0]
        return next(one.now.tool_slot for one in self._passed if one.kind == "response")

    def _of_beats(self) -> None:
        beats = [one for one in self._signs if one.kind == "beat"]
        self._at = len(self._passed) - 1
        words = [one.number for one in beats]
        if not all(a != b for a, b in pairwise(words)):
            self._broken.append("two beats with one word")
        epochs = {one.command.epoch & 0xFF for one in self._signs if one.command.epoch}
        if not {word >> 8 for word in words} <= epochs:
            self._broken.append("a beat of another epoch")

    def _of_the_end(self) -> None:
        commands = [one.command for one in self._passed if one.kind == "command"]
        last = commands[-1] if commands else Command(0, Opcode.OWNERSHIP)
        if (last.opcode, last.operands[0]) != (Opcode.OWNERSHIP, 0):
            self._broken.append("the mailbox was not given back")
        shown = [one.now.tool_slot for one in self._passed if one.kind == "response"]
        if shown and shown[0] != shown[-1]:
            self._broken.append("another tool is selected in the end")


def _ended(command: Command, now: Response) -> bool:
    ours = (now.ack_owner, now.ack_head) == (command.owner, command.sequence)
    return (ours and now.state in ENDED) or any(
        end.sequence == command.sequence and end.state in ENDED for end in now.finished
    )
