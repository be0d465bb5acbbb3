"""Every kind of controller, and the acts that Python code can ask of each."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field, replace
from functools import partial

from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.plc import PlcSimulator
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator
from robolink_simulators.testkit.media import served

import robolink
from robolink.controllers import ConnectionTerms, PlcMapController, SimpleController, SimpleMachine
from robolink.controllers.softmotion.jog import Jog
from robolink.journal import memory_journal, signature_here
from robolink.model import (
    ANY,
    Controller,
    MarkerKind,
    MotionProfile,
    OutcomeLog,
    Path,
    ToolOffset,
    WorkBox,
)
from robolink.protocols.mailbox import Kinematics
from robolink.register_maps import load_symbol_map
from robolink.testing import Subject, confirm_whole_map
from robolink.testing.subject import another_offset
from robolink.transport import parse_url
from tests.contract.third_kind import BenchServer, open_bench
from tests.unit._plc_bench import COMMIT_BIT, EXAMPLES, Bench, LocalClient
from tests.unit._symbol_bench import LocalSymbolClient, SymbolBench

Act = Callable[[Controller, int], object]
_PROFILE = MotionProfile(Path.STRAIGHT, speed_mm_s=10.0)


@dataclass(frozen=True)
class Kind:
    """A kind of controller under test.

    Attributes:
        opened: Connects, with the test's own record if one is given.
        tool: A tool that may be written and cleared.
        prepare: Makes a fresh connection ready to move.
        more: Additional acts of this kind.
        without: Acts that this kind lacks.
    """

    opened: Callable[[OutcomeLog | None], Controller]
    tool: int = 1
    prepare: Callable[[Controller], None] = lambda _controller: None
    more: Mapping[str, Act] = field(default_factory=dict)
    without: Sequence[str] = ()

    @property
    def subject(self) -> Subject:
        """The subject of the contract checks."""
        return Subject(lambda: self.opened(None), tool=self.tool, prepare=self.prepare)

    @property
    def acts(self) -> dict[str, Act]:
        """All acts that write or move, by name; at the end the tool is undefined."""
        acts: dict[str, Act] = {
            "write": write,
            "blind write": write_blindly,
            "change": begin_change,
            "preserve": preserve,
            "move": move,
            **self.more,
            "select": select,
            "clear": clear,
        }
        return {name: act for name, act in acts.items() if name not in self.without}


def write(controller: Controller, tool: int) -> object:
    """Write a value other than the stored one."""
    before = controller.tools.read(tool)
    return controller.tools.write(tool, another_offset(before), expected=before)


def write_blindly(controller: Controller, tool: int) -> object:
    """Write without comparing the stored value."""
    there = controller.tools.read(tool)
    return controller.tools.write(tool, another_offset(there), expected=ANY)


def clear(controller: Controller, tool: int) -> object:
    """Clear the tool."""
    return controller.tools.clear(tool, expected=ANY, then_select=0)


def select(controller: Controller, tool: int) -> None:
    """Select another tool."""
    controller.tools.select(0 if controller.tools.selected() else tool)


def move(controller: Controller, _tool: int) -> object:
    """Move up by 1 mm."""
    group = controller.groups[0]
    start = group.pose()
    box = WorkBox.around(start, xy_mm=5, below_mm=5, above_mm=5)
    target = replace(start, z_mm=start.z_mm + 1)
    return group.move_to(target, _PROFILE, box=box).wait(timeout_s=30)


def preserve(controller: Controller, _tool: int) -> object:
    """Begin and end a procedure."""
    with controller.preserved("a procedure"):
        return None


def begin_change(controller: Controller, tool: int) -> object:
    """Begin a tool change of several steps."""
    return controller.begin(MarkerKind.CHANGE, "a change", {"tools": {}, "tool": tool})


def _jog(controller: Controller, _tool: int) -> object:
    group = controller.groups[0]
    box = WorkBox.around(group.pose(), xy_mm=50, below_mm=50, above_mm=50)
    return group.jog(Jog(forward=frozenset({2})), duration_s=0.1, box=box)  # type: ignore[attr-defined]


def _kinematics(controller: Controller, _tool: int) -> object:
    return controller.set_kinematics(Kinematics.SCARA3_Z)  # type: ignore[attr-defined]


def _output(controller: Controller, _tool: int) -> object:
    io = controller.io
    assert io is not None
    return io.set_output(3, True)


def _epson_output(controller: Controller, _tool: int) -> object:
    io = controller.io
    assert io is not None
    return io.set_output(3, not io.read_output(3))  # type: ignore[attr-defined]


def _raw(controller: Controller, _tool: int) -> object:
    return controller.execute_raw("Off 3")  # type: ignore[attr-defined]


def _switch_on(controller: Controller) -> None:
    controller.motors(True)


@contextmanager
def memory() -> Iterator[Kind]:
    """The in-memory controller of ``robolink.testing``."""
    machine = SimpleMachine(tools={1: ToolOffset(12.0, -3.5, -20.0)})
    yield Kind(lambda outcomes: SimpleController(machine, outcomes=outcomes))


@contextmanager
def epson() -> Iterator[Kind]:
    """A simulated EPSON controller."""
    with served(EpsonSimulator(seed=3)) as url:
        yield Kind(
            lambda outcomes: robolink.connect(url, outcomes=outcomes),
            prepare=_switch_on,
            more={"output": _epson_output, "raw": _raw},
        )


@contextmanager
def softmotion(medium: str = "sim") -> Iterator[Kind]:
    """A simulated PLC with a mailbox."""
    with served(SoftMotionSimulator(seed=3), medium) as url:
        yield Kind(
            lambda outcomes: robolink.connect(url, outcomes=outcomes),
            prepare=_switch_on,
            more={"output": _output, "jog": _jog, "kinematics": _kinematics},
        )


@contextmanager
def plc_map() -> Iterator[Kind]:
    """A PLC accessed through a map; it does not move."""
    bench = Bench(COMMIT_BIT, identity="plc+modbus-tcp://contract")

    def opened(outcomes: OutcomeLog | None) -> Controller:
        client = LocalClient(bench.plc, bench.identity)
        client.clock.advance(bench.plc.now_ns / 1e9)
        log = outcomes or memory_journal(bench.identity).log(bench.identity)
        return PlcMapController(client, bench.map, log)

    yield Kind(opened, tool=min(bench.map.slots), without=("move", "select", "clear"))


@contextmanager
def plc_symbols() -> Iterator[Kind]:
    """A PLC accessed through a map of its variables, as over OPC UA; it does not move."""
    bench = SymbolBench(EXAMPLES / "by-symbol.toml", identity="plc+opcua://contract")

    def opened(outcomes: OutcomeLog | None) -> Controller:
        client = LocalSymbolClient(bench.program, bench.identity, bench.clock)
        log = outcomes or memory_journal(bench.identity).log(bench.identity)
        return PlcMapController(client, bench.map, log)

    yield Kind(opened, tool=min(bench.map.slots), without=("move", "select", "clear"))


@contextmanager
def plc_opcua() -> Iterator[Kind]:
    """The same PLC behind an OPC UA server."""
    path = EXAMPLES / "by-symbol.toml"
    symbols = load_symbol_map(path)
    with served(PlcSimulator(symbols, seed=3), "opcua", map_file=path) as url:
        with robolink.connect(url) as controller:
            confirm_whole_map(controller)
        yield Kind(
            lambda outcomes: robolink.connect(url, outcomes=outcomes), tool=min(symbols.slots)
        )


@contextmanager
def third_kind() -> Iterator[Kind]:
    """A kind that another package supplies."""
    with BenchServer() as server:
        url = parse_url(server.url)

        def opened(outcomes: OutcomeLog | None) -> Controller:
            return open_bench(url, ConnectionTerms(signature_here("test"), outcomes=outcomes))

        yield Kind(opened)


KINDS = {
    kind.__name__: kind for kind in (memory, epson, softmotion, plc_map, plc_symbols, third_kind)
}
OVER_OPCUA: dict[str, Callable[[], AbstractContextManager[Kind]]] = {
    "softmotion": partial(softmotion, "opcua"),
    "plc_opcua": plc_opcua,
}
"""Kinds behind a server on a port, in real time."""
IMMOBILE = ("plc_map", "plc_symbols", "plc_opcua")
