"""All small faults of a whole calibration: their list, and a run with each one."""

import random
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache

from robolink.controllers.softmotion.snapshots import read_block
from robolink.errors import RobolinkError
from robolink.protocols import NEED_DATA, Role
from robolink.protocols.epson_text import EpsonTextCodec, Reply, parse_status
from robolink.protocols.mailbox import BlockError, decode_slot
from robolink.protocols.spel import parse_point, parse_tool_listing
from robolink.transport.modbus.frames import FrameError, TcpFraming
from tests.faults.small.cells import Steps, calibrated, wired_cell
from tests.faults.small.judging import judge
from tests.faults.small.wire import Act, SmallFault

_POINT = re.compile(r"Print (RealPos|TLSet\()")
"""Queries whose answer is a point."""

_LISTING = '$Execute,"TLSet"'


@dataclass(frozen=True, order=True)
class Pair:
    """A shape of request in one step; the first exchange of that kind is disturbed."""

    shape: str
    step: str

    def __str__(self) -> str:
        return f"{self.shape} | {self.step}"


@dataclass
class Group:
    """Faults at one place that the driver's decoder cannot distinguish: one run shows them all."""

    fault: SmallFault
    members: int = 1


@dataclass
class Recording:
    """One undisturbed run.

    Attributes:
        replies: The first request and answer of each pair.
    """

    replies: dict[Pair, tuple[bytes, bytes]] = field(default_factory=dict)


@cache
def recorded(kind: str) -> Recording:
    """Run a calibration undisturbed."""
    recording, steps, asked = Recording(), Steps(), dict[bytes, Pair]()
    with wired_cell(kind) as cell:

        def on_request(request: bytes) -> None:
            asked[request] = Pair(cell.shape(request), steps.now)

        def on_reply(request: bytes, reply: bytes) -> None:
            recording.replies.setdefault(asked[request], (request, reply))

        cell.wire.on_request, cell.wire.on_reply = on_request, on_reply
        ended = calibrated(cell, steps)
        assert judge(cell, ended) == "done", ended.err
    return recording


def faults_at(kind: str, pair: Pair, reply: bytes) -> list[SmallFault]:
    """Return every small fault of one exchange.

    A duplicated request is for the mailbox, whose commands are numbered. EPSON's are not: no driver
    could detect it, and TCP delivers nothing twice.
    """
    acts = [Act.DROP_REQUEST, Act.DROP_REPLY, Act.DELAY, Act.DUPLICATE_REPLY]
    if kind == "PLC":
        acts.append(Act.DUPLICATE_REQUEST)
    return [
        *(SmallFault(act) for act in acts),
        *(SmallFault(Act.TRUNCATE, count) for count in range(1, len(reply))),
        *(SmallFault(Act.FLIP, bit) for bit in range(8 * len(reply))),
    ]


def groups_at(kind: str, pair: Pair, request: bytes, reply: bytes) -> list[Group]:
    """Return the faults of one exchange, joined where they are the same to the driver."""
    groups: dict[object, Group] = {}
    for fault in faults_at(kind, pair, reply):
        key: object = fault
        if fault.act in (Act.TRUNCATE, Act.FLIP):
            ((_, bent),) = fault.bent(reply)
            key = _DECODED[kind](pair, request, bent)
        if key in groups:
            groups[key].members += 1
        else:
            groups[key] = Group(fault)
    return list(groups.values())


def _text_as_decoded(pair: Pair, _request: bytes, bent: bytes) -> object:
    codec = EpsonTextCodec(Role.HOST)
    events: list[object] = []
    try:
        codec.receive_data(bent)
        while (event := codec.next_event()) is not NEED_DATA:
            events.append(_text(pair, event))
    except RobolinkError as error:
        events.append(type(error))
    # The rest waits for an end that never comes; if the quotes and the line end are broken, the
    # next answer is read behind it.
    return (*events, bool(codec.bytes_held), bent.count(b'"') % 2, bent.endswith(b"\r\n"))


def _text(pair: Pair, event: object) -> object:
    """Return an answer as the driver reads it, such as a point's numbers or a status's flags.

    All unreadable answers count as the same one.
    """
    if not isinstance(event, Reply) or (event.text or "").lstrip().startswith("!"):
        return repr(event)
    try:
        if event.text is not None and _POINT.search(pair.shape):
            return repr(parse_point(event.text))
        if event.text is not None and pair.shape == _LISTING:
            return repr(parse_tool_listing(event.text))
        if event.text is None and pair.shape == "$GetStatus" and event.name == "GetStatus":
            return repr(parse_status(event))
    except RobolinkError:
        return "unreadable"
    return repr(event)


def _words_as_decoded(pair: Pair, request: bytes, bent: bytes) -> object:
    buffer = bytearray(bent)
    try:
        reply = TcpFraming().take(buffer)
    except FrameError:
        return "no frame"
    if reply is None:
        # It waits for bytes that never come: the deadline passes, and the link is closed.
        return "incomplete"
    if reply.transaction != int.from_bytes(request[:2]):
        return "another's", len(buffer)
    head = (reply.unit, reply.function, reply.refusal, reply.address, reply.count, len(buffer))
    return (*head, len(reply.values), _block(pair, reply.values))


def _block(pair: Pair, values: tuple[int, ...]) -> object:
    decode: Callable[..., object]
    if pair.shape.startswith("read_response"):
        decode = lambda words: read_block(words, controller="")  # noqa: E731
    elif pair.shape.startswith("read_slot"):
        decode = decode_slot
    else:
        return values
    try:
        return decode(values)
    except BlockError as error:
        return error.fault
    except (RobolinkError, ValueError) as error:
        return str(error)


_DECODED = {"EPSON": _text_as_decoded, "PLC": _words_as_decoded}


def run_with(kind: str, pair: Pair, fault: SmallFault) -> str:
    """Run a calibration with one disturbance; return how it ended.

    Raises:
        Wrong: It broke a promise.
    """
    steps, waiting = Steps(), [fault]
    with wired_cell(kind) as cell:

        def on_request(request: bytes) -> SmallFault | None:
            if waiting and Pair(cell.shape(request), steps.now) == pair:
                return waiting.pop()
            return None

        cell.wire.on_request = on_request
        ended = calibrated(cell, steps)
        assert not waiting, "the exchange was not reached"
        return judge(cell, ended)


@dataclass(frozen=True)
class Planned:
    """One planned run: its place, its fault, and the number of equivalent faults."""

    kind: str
    pair: Pair
    fault: SmallFault
    members: int

    def __str__(self) -> str:
        return f"{self.kind} | {self.pair} | {self.fault}"


@cache
def planned(kind: str) -> tuple[Planned, ...]:
    """Return every run that all small faults of one kind of controller need."""
    return tuple(
        Planned(kind, pair, group.fault, group.members)
        for pair, (request, reply) in recorded(kind).replies.items()
        for group in groups_at(kind, pair, request, reply)
    )


def drawn(kind: str, count: int, seed: int) -> list[Planned]:
    """Return the given number of runs, each of another pair; nothing is decoded for it."""
    chance, pairs = random.Random(seed), recorded(kind).replies
    return [
        Planned(kind, pair, chance.choice(faults_at(kind, pair, pairs[pair][1])), 1)
        for pair in chance.sample(sorted(pairs), count)
    ]
