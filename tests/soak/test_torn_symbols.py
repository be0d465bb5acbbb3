"""100,000 reads of a mailbox and of maps at OPC UA servers that tear: none is believed torn.

The simulated program changes its values all the time, and the server puts an answer together from
two of its cycles. The truth is known: what was ever there in one cycle.
"""

import random
import struct
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any, Final

import pytest
from robolink_simulators.cell.clock import ManualClock, ScaledClock, SteeredClock
from robolink_simulators.faults import Fault, FaultAction, PlcFault, PlcFaultAction
from robolink_simulators.hosting.fieldbus.opcua import serve_opcua
from robolink_simulators.plc import PlcSimulator
from robolink_simulators.softmotion import CoordSystem, Dynamics, SmcBufferMode, Target
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

import robolink
from robolink.controllers import PlcMapController
from robolink.errors import RemoteProtocolError
from robolink.journal import memory_journal
from robolink.protocols.mailbox import BlockError, decode_response
from robolink.register_maps import load_symbol_map
from robolink.transport import open_mailbox_link, told_to

pytestmark = [pytest.mark.soak, pytest.mark.timeout(3600)]

READS: Final = 100_000
SPEED: Final = 50.0
"""Simulated seconds per second: a cycle of 4 ms passes in 80 us."""
SLOWLY: Final = Dynamics(0.05, 0.05, 0.05, 0.05)
CUTS: Final = (1, 3, 9, 10, 20, 47, 90, 107, 111, 116, 142, 146, 150, 179)
"""Elements at which an answer is torn, in turn; behind its end they count from the front."""

ANSWER_MS: Final = 0.7
"""Until a map's answer leaves: no whole part of a cycle, so readings fall anywhere in one."""
MOST_WHOLE: Final = 5
"""Most answers about a map between two that are torn; of seven, two are."""


def offset_of(generation: int) -> tuple[float, float, float, float]:
    """Return X, Y, Z, U of which no two are the same in two generations."""
    n = generation % 1009 + 1
    return n / 8, -n / 16, n / 4 - 100, n / 8


def is_whole(x: float, y: float, z: float, u: float) -> bool:
    """Return whether these are of one generation; angles pass through a rotation."""
    due = offset_of(round(8 * x) - 1)
    return all(abs(a - b) < 1e-6 for a, b in zip((x, y, z, u), due, strict=True))


def is_decoded(block: list[int]) -> bool:
    """Return whether head, tail and checksum of a response fit."""
    try:
        decode_response(block)
    except BlockError:
        return False
    return True


class Told:
    """What became of the reads."""

    def __init__(self) -> None:
        self.accepted = self.refused = self.torn = 0
        self.values: set[object] = set()

    def one(self, read: Callable[[], Any], whole: Callable[[Any], bool]) -> None:
        """Read once; what is refused may be read again, what is accepted must be whole."""
        try:
            value = read()
        except (BlockError, RemoteProtocolError):
            self.refused += 1
            return
        self.accepted += 1
        self.values.add(hash(value))
        self.torn += not whole(value)

    def check(self, met: int, name: str) -> None:
        """Check that nothing torn was accepted, and that this run could have shown it."""
        print(  # noqa: T201 - for pytest -s
            f"{name}: {self.accepted} accepted, {len(self.values)} different, {self.refused} "
            f"refused, {met} answers torn, {self.torn} torn ones accepted"
        )
        assert self.torn == 0
        assert self.accepted > self.refused
        assert met > self.accepted // 10
        assert len(self.values) > self.accepted // 100


@pytest.fixture(scope="module")
def published() -> Iterator[tuple[SoftMotionSimulator, str]]:
    """A PLC whose first slot changes in each cycle, and its URL."""
    simulator = SoftMotionSimulator(seed=5)
    plc = simulator.plc
    read = plc.read

    def noted(first: int, count: int, now_ns: int) -> Any:
        generation = now_ns // round(simulator.options.group.cycle_us * 1000)
        x, y, z, u = offset_of(generation)
        plc.memory.define(1, (x, y, z, u, 0.0, 0.0), f"generation {generation % 1000}")
        return read(first, count, now_ns)

    plc.read = noted  # type: ignore[method-assign]
    with serve_opcua(simulator, clock=ScaledClock(SPEED)) as host:
        yield simulator, host.url


@contextmanager
def tearing(
    simulator: SoftMotionSimulator, match: str, *, cuts: range | tuple[int, ...] = CUTS, of: int = 2
) -> Iterator[Callable[[], int]]:
    """Tear one answer of so many; yields how many were torn so far."""
    for number, cut in enumerate(cuts):
        simulator.faults.add(
            PlcFault(
                PlcFaultAction.TEAR_ARRAY,
                on_exchange=of * number,
                match=match,
                position=cut,
                every=of * len(cuts),
            )
        )
    before = simulator.faults.times_fired
    try:
        yield lambda: simulator.faults.times_fired - before
    finally:
        simulator.faults.clear()


@pytest.mark.fault("F31")
def test_f31_no_response_of_a_moving_robot_is_believed_torn():
    """The robot moves to and fro, and each answer is of another cycle."""
    simulator = SoftMotionSimulator(seed=5)
    plc, group = simulator.plc, simulator.plc.group
    here = group.values
    ends = (tuple(value + 10 for value in here), here)
    shown: set[int] = set()
    answers = torn = missed = by_checksum = 0
    read = plc.read

    def noted(first: int, count: int, now_ns: int) -> Any:
        if len(group.motion.queue.unfinished) < 2:
            for end in ends:
                target = Target((*end, 0.0, 0.0), CoordSystem.ACS)
                move = group.move_direct_absolute(target, SLOWLY, mode=SmcBufferMode.BUFFERED)
                assert move.outputs.error is None
        words = read(first, count, now_ns)
        shown.add(hash(words))
        return words

    def judge(_at_ns: int, _direction: str, data: bytes) -> None:
        """Count an answer as torn if its words are of no moment."""
        nonlocal answers, torn, missed, by_checksum
        first, *block, last = struct.unpack(">114H", data)
        answers += 1
        if hash(tuple(block)) not in shown:
            torn += 1
            missed += first == last
            by_checksum += is_decoded(block)

    plc.read = noted  # type: ignore[method-assign]
    clock = SteeredClock(0.0, exchange_s=simulator.options.group.cycle_us / 1e6)
    told = Told()
    with serve_opcua(simulator, clock=clock) as host, told_to(judge):
        with closing(open_mailbox_link(host.url, timeout_s=30.0)) as link:
            with tearing(simulator, "read_response", cuts=range(1, 114), of=3):
                for _ in range(READS):
                    told.one(link.read_response, lambda words: hash(words) in shown)
    print(  # noqa: T201 - for pytest -s
        f"response: {told.accepted} accepted, {len(told.values)} different, {told.refused} "
        f"refused; {torn} of {answers} answers torn, {by_checksum} of them with the right "
        f"checksum, {missed} between equal counts; {told.torn} torn ones accepted"
    )
    assert (told.torn, missed, told.refused) == (0, 0, 0)
    assert torn > answers // 4
    assert len(told.values) > told.accepted * 0.9


@pytest.mark.fault("F31")
def test_f31_no_slot_of_a_mailbox_is_believed_torn(published):
    simulator, url = published
    told = Told()
    log = memory_journal(url).log(url)
    with robolink.connect(url, outcomes=log, timeout_s=30.0) as controller:
        with tearing(simulator, "read_slots") as met:
            for _ in range(READS):
                told.one(
                    lambda: controller.tools.read(1),
                    lambda tool: is_whole(tool.x_mm, tool.y_mm, tool.z_mm, tool.u_deg),
                )
            told.check(met(), "slot")


_MAP: Final = """
schema = "robolink/plc-map/1"
name = "torn"
{time}
[numbers]
root = "ns=4;s=|var|PLC.Application.GVL."
type = "LREAL"
[[tools]]
number = 1
{tool}
[commit]
kind = "level"
request = {{ node = "xRequest" }}
acknowledge = {{ node = "xDone" }}
{more}
"""
_ARRAY: Final = 'node = "aTool"\nlength = 6\n' + "\n".join(
    f"{name} = {{ element = {place} }}" for place, name in enumerate("xyzu")
)
_NODES: Final = "\n".join(f'{name} = {{ node = "r{name.upper()}" }}' for name in "xyzu")
MAPS: Final = {
    "array, cycle counter": (_ARRAY, '[cycle_counter]\nnode = "udiCycle"'),
    "array, time": (_ARRAY, ""),
    "array, change counter": (_ARRAY, '[change_counter]\nnode = "udiChanges"'),
    "nodes, cycle counter": (_NODES, '[cycle_counter]\nnode = "udiCycle"'),
    "nodes, change counter": (_NODES, '[change_counter]\nnode = "udiChanges"'),
}


def tears_of(name: str) -> Iterator[Fault]:
    """Return tears inside the tool, one after another: with either part the older one.

    They are drawn. A pattern that repeats falls into step with the readings: some of its places
    and orders then never come where a careless client would believe them.
    """
    inside, node = FaultAction.TEAR_ARRAY, "aTool"
    if "array" not in name:
        inside, node = FaultAction.TEAR_NODES, "rX"
    before = int("nodes, cycle" in name)  # the count that such an answer begins with
    chance = random.Random(f"tears, {name}")
    while True:
        cut, whole_answers = before + chance.randint(1, 3), chance.randint(0, MOST_WHOLE)
        yield Fault(inside, whole_answers, match=node, position=cut, bit=chance.randint(0, 1))


@pytest.mark.fault("F31")
@pytest.mark.parametrize("name", MAPS)
def test_f31_no_tool_of_a_map_is_believed_torn(tmp_path: Path, name: str):
    """The program changes the tool while the server copies it, in each answer that is torn.

    Time is virtual: a wait for the program's next cycle takes none of ours.
    """
    from tests._stepped_opcua import SteppedOpcua  # a second, which collection does not need

    tool, more = MAPS[name]
    path = tmp_path / "torn.toml"
    time = "" if "cycle counter" in name else "cycle_ms = 20"
    path.write_text(_MAP.format(tool=tool, more=more, time=time), encoding="utf-8")
    symbol_map = load_symbol_map(path)
    plc = PlcSimulator(symbol_map, seed=5, answer_ms=ANSWER_MS)
    served = SteppedOpcua(plc, ManualClock())
    told = Told()
    met: list[Fault] = []
    tears = tears_of(name)
    changes = 0

    def tear(fault: Fault, _request: str) -> None:
        met.append(fault)
        plc.faults.add(next(tears))

    def change(_number: int, _text: str) -> None:
        nonlocal changes
        if met:
            met.clear()
            changes += 1
            plc.program.set_tool(1, dict(zip("xyzu", offset_of(changes), strict=True)))

    plc.program.set_tool(1, dict(zip("xyzu", offset_of(changes), strict=True)))
    plc.faults.on_fired = tear
    plc.on_reply = change
    log = memory_journal("plc+opcua://cell").log("plc+opcua://cell")
    client = served.variables("plc+opcua://cell", 30.0)
    with PlcMapController(client, symbol_map, log) as controller:
        controller.require_probe()  # as connecting does: it asks for each node alone, once
        plc.faults.add(next(tears))
        for _ in range(READS // len(MAPS)):
            told.one(
                lambda: controller.tools.read(1),
                lambda tool: is_whole(tool.x_mm, tool.y_mm, tool.z_mm, tool.u_deg),
            )
    assert plc.faults.times_fired == changes  # each was a mixture, or it would not count
    told.check(changes, name)
