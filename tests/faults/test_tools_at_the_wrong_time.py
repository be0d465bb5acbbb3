"""Rows F41, F42 and F45 of the catalogue: which tool, when, and the other writers.

On an EPSON controller over TCP and on PLC mailboxes over their field buses; the controller's real
values, and the number of writes, are read past the wire.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.streams.epson import serve_tcp
from robolink_simulators.plc import PlcSimulator, serve_plc

import robolink
from robolink.controllers import PlcMapController
from robolink.errors import (
    BusyError,
    NotReadyError,
    NotReadyReason,
    ReadBackError,
    ReservedToolError,
    ToolChangedError,
    ToolIndexError,
)
from robolink.model import ANY, Controller, MotionProfile, ToolOffset, WorkBox
from robolink.model import Path as Way
from robolink.protocols.mailbox import to_frame
from robolink.register_maps import load_map
from robolink.testing import confirm_whole_map
from tests.contract._softmotion_cell import SLOW, above, served

STORED = ToolOffset(12.0, -3.5, -20.0)
MINE = ToolOffset(12.125, -3.5, -20.0)
OF_THE_PENDANT = ToolOffset(15.5, 1.25, -21.0)


@dataclass
class Held:
    """A controller that holds :data:`STORED` in tool 1, and its true state.

    Attributes:
        url: Its URL.
        now: The value of tool 1, past the wire.
        put: Writes tool 1, past the wire, as a pendant does.
        before_each: Calls something before each request is carried out.
        writes: The number of tool writes by clients so far.
    """

    url: str
    now: Callable[[], ToolOffset | None]
    put: Callable[[ToolOffset], None]
    before_each: Callable[[Callable[[str], None] | None], None]
    writes: Callable[[], int]


@contextmanager
def epson() -> Iterator[Held]:
    simulator = EpsonSimulator(seed=2)
    tools = simulator.machine.tools
    tools.set(1, STORED)

    def before_each(act: Callable[[str], None] | None) -> None:
        simulator.on_request = None if act is None else lambda _number, text: act(text)

    def writes() -> int:
        arrived = [text for _, direction, text in simulator.log if direction == ">"]
        return sum('"TLSet 1, XY' in text for text in arrived)

    with serve_tcp(simulator, clock=ScaledClock(40.0)) as host:
        yield Held(host.url, lambda: tools.get(1), lambda v: tools.set(1, v), before_each, writes)


@contextmanager
def mailbox(bus: str) -> Iterator[Held]:
    with served(bus) as cell:
        simulator, memory = cell.simulator, cell.simulator.plc.memory

        def put(value: ToolOffset) -> None:
            memory.define(1, to_frame(value.components(), unit_um=1000.0), "pendant")

        def now() -> ToolOffset:
            x, y, z, *_ = memory.defined()[1].tool
            return ToolOffset(x, y, z)

        def before_each(act: Callable[[str], None] | None) -> None:
            simulator.on_request = None if act is None else lambda _number, text: act(text)

        put(STORED)
        yield Held(cell.url, now, put, before_each, lambda: cell.commands.count("WRITE_TOOL"))


KINDS = {
    "epson": epson,
    "mailbox on Modbus TCP": lambda: mailbox("modbus-tcp"),
    "mailbox on CAN": lambda: mailbox("can-virtual"),
}


@pytest.fixture(
    params=[
        "epson",
        "mailbox on Modbus TCP",
        pytest.param("mailbox on CAN", marks=pytest.mark.soak),
    ]
)
def held(request: pytest.FixtureRequest) -> Iterator[Held]:
    with KINDS[request.param]() as held:
        yield held


# ---- F41

WRONG = (-1, 16, 100, 2**63, -(2**63), True, 1.0, 1.5, float("nan"), "1", "", None, (1,))
"""Not a tool of any of them; Python counts some of them as 1."""


@pytest.fixture
def each_kind() -> Iterator[list[Controller]]:
    """One controller of each kind."""
    path = Path("examples/plc-maps/level-handshake.toml")
    register_map = load_map(path)
    with (
        epson() as one,
        mailbox("modbus-tcp") as two,
        serve_plc(PlcSimulator(register_map, seed=7), path, clock=ScaledClock(10.0)) as three,
        robolink.connect(one.url) as first,
        robolink.connect(two.url) as second,
        robolink.connect(three.url) as third,
    ):
        assert isinstance(third, PlcMapController)
        confirm_whole_map(third)
        yield [first, second, third]


@pytest.mark.fault("F41")
def test_f41_no_wrong_number_of_a_tool_reaches_a_controller(each_kind: list[Controller]) -> None:
    for controller in each_kind:
        tools: Any = controller.tools
        sent = controller.exchanges
        for index in WRONG:
            with pytest.raises(ToolIndexError):
                tools.write(index, MINE, expected=ANY)
            with pytest.raises(ToolIndexError):
                tools.clear(index, expected=ANY)
            with pytest.raises(ToolIndexError):
                tools.select(index)
        assert controller.exchanges == sent


@pytest.mark.fault("F41")
def test_f41_tool_0_is_never_written(each_kind: list[Controller]) -> None:
    for controller in each_kind:
        sent = controller.exchanges
        with pytest.raises(ReservedToolError):
            controller.tools.write(0, MINE, expected=ANY)
        with pytest.raises(ReservedToolError):
            controller.tools.clear(0, expected=ANY)
        assert controller.exchanges == sent


@pytest.mark.fault("F41")
def test_f41_a_value_that_is_not_the_expected_one_is_not_written_over(held: Held) -> None:
    held.put(OF_THE_PENDANT)
    writes = held.writes()
    with robolink.connect(held.url) as controller, pytest.raises(ToolChangedError):
        controller.tools.write(1, MINE, expected=STORED)
    assert held.now() == OF_THE_PENDANT
    assert held.writes() == writes


# ---- F42


def tool_changes(controller: Controller) -> list[Callable[[], object]]:
    tools = controller.tools
    return [
        lambda: tools.write(1, MINE, expected=STORED),
        lambda: tools.clear(1, expected=STORED, then_select=0),
        lambda: tools.select(0),
    ]


@pytest.mark.fault("F42")
def test_f42_no_tool_of_an_epson_controller_is_changed_while_the_robot_moves() -> None:
    simulator = EpsonSimulator(seed=2)
    machine = simulator.machine
    machine.tools.set(1, STORED)
    with serve_tcp(simulator) as host, robolink.connect(host.url) as controller:
        controller.motors(True)
        group = controller.groups[0]
        here = group.pose()
        creeping = MotionProfile(Way.STRAIGHT, 1, 1.0)
        group.move_to(replace(here, z_mm=here.z_mm + 30), creeping, box=WorkBox())
        written = machine.flash_writes
        for change in tool_changes(controller):
            with pytest.raises((BusyError, NotReadyError)):
                change()
        assert machine.arm.moving
        assert machine.flash_writes == written
        assert (machine.tools.get(1), machine.tools.selected) == (STORED, 1)
        controller.stop()


@pytest.mark.fault("F42")
def test_f42_no_tool_of_an_epson_controller_is_changed_while_its_program_runs() -> None:
    simulator = EpsonSimulator(seed=2)
    machine = simulator.machine
    machine.tools.set(1, STORED)
    with serve_tcp(simulator) as host, robolink.connect(host.url) as controller:
        written = machine.flash_writes
        simulator.panel.start_production()
        for change in tool_changes(controller):
            with pytest.raises(NotReadyError) as refusal:
                change()
            assert refusal.value.reason is NotReadyReason.RUNNING
        simulator.panel.stop_production()
        assert machine.flash_writes == written
        assert (machine.tools.get(1), machine.tools.selected) == (STORED, 1)


@pytest.mark.fault("F42")
def test_f42_no_tool_of_a_plc_is_changed_while_its_group_moves() -> None:
    with served("modbus-tcp") as cell, cell.connect() as controller:
        group = controller.groups[0]
        stored = controller.tools.read(1)
        assert stored is not None
        motion = group.move_to(above(group.pose(), 20.0), SLOW, box=WorkBox())
        changes, slots = len(cell.commands), cell.slot_changes(1)
        for change in (
            lambda: controller.tools.write(1, MINE, expected=stored),
            lambda: controller.tools.write(3, MINE, expected=None),
            lambda: controller.tools.select(0),
        ):
            with pytest.raises(NotReadyError) as refusal:
                change()
            assert refusal.value.reason is NotReadyReason.RUNNING
        assert len(cell.commands) == changes
        assert (cell.slot_changes(1), cell.slot_changes(3)) == (slots, 0)
        assert controller.tools.selected() == 1
        assert not motion.settled
        controller.stop()


# ---- F45


@pytest.mark.fault("F45")
def test_f45_what_a_pendant_writes_at_any_step_is_found_out(held: Held) -> None:
    """Up to the last reading it is refused, with both values; only the write itself is blind."""
    steps: list[str] = []
    for requests in ([], steps):  # a new controller is asked more
        assert write_with_the_pendant_at(held, None, requests) == "done"
    ends = [write_with_the_pendant_at(held, step, []) for step in range(len(steps))]
    written = next(step for step, text in enumerate(steps) if is_write(text))
    last_look = max(step for step, end in enumerate(ends) if end == "refused")
    assert last_look < written
    assert set(ends[: last_look + 1]) == {"refused"}, list(zip(steps, ends, strict=True))
    # No reading that could still see it lies between the last check and the write.
    assert not any(is_look(text) for text in steps[last_look + 1 : written])
    assert ends[written + 1 :].count("read back") >= 1, list(zip(steps, ends, strict=True))


def is_write(text: str) -> bool:
    return "TLSet 1, XY" in text or "WRITE_TOOL" in text


def is_look(text: str) -> bool:
    return "TLSet" in text or "read_slot" in text


def write_with_the_pendant_at(held: Held, step: int | None, seen: list[str]) -> str:
    """Write tool 1 while a pendant writes it before the request of that number.

    Args:
        held: The controller.
        step: Counted from 0, without the polls for the end of a command; ``None`` for never.
        seen: Receives the requests.

    Returns:
        How it ended: refused, done, or found out by reading back.
    """
    held.put(STORED)
    left, writes = step, held.writes()

    def act(text: str) -> None:
        nonlocal left
        if text == "read_head":
            return  # the number of polls for the end of a command is random
        seen.append(text)
        if left is not None:
            if left == 0:
                held.put(OF_THE_PENDANT)
            left -= 1

    with robolink.connect(held.url) as controller:
        held.before_each(act)
        try:
            controller.tools.write(1, MINE, expected=STORED)
        except (ToolChangedError, ReadBackError) as error:
            refusal = error
        else:
            return "done"
        finally:
            held.before_each(None)
    assert "15.5" in refusal.what
    assert "12" in refusal.what
    assert held.now() == OF_THE_PENDANT
    if isinstance(refusal, ReadBackError):
        return "read back"
    assert held.writes() == writes
    return "refused"
