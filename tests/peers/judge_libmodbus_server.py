"""Our driver for mapped PLCs with a PLC in the form of a C program on libmodbus."""

import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from robolink_simulators.hosting.streams.serial_host import SerialCable

import robolink
from robolink import ToolOffset
from robolink.errors import NotComparedError, RejectedError
from robolink.testing import confirm_whole_map
from robolink.transaction import Wanted, change_tools
from tests._patience import PATIENCE_S

MAP = Path("examples/plc-maps/commit-bit.toml").absolute()
OLD = {1: ToolOffset(12.0, -3.5, -20.0, 15.0), 2: ToolOffset(-12.0, -3.5, -21.0)}
NEW = {1: ToolOffset(12.25, -3.125, -20.0, 15.5), 2: ToolOffset(-11.75, -3.5, -21.5)}
TOO_FAR = ToolOffset(60.0, -3.5, -20.0)


@dataclass
class MappedPlc:
    """A PLC in a process of its own; ``in_force`` is complete when that has ended."""

    url: str
    process: subprocess.Popen[str]
    in_force: list[list[float]] = field(default_factory=list)

    def end(self) -> None:
        """End the process and collect the values that it applied, each time."""
        self.process.kill()
        printed, _ = self.process.communicate(timeout=PATIENCE_S)
        takeovers = [line for line in printed.splitlines() if line.startswith("in force ")]
        self.in_force = [[float(text) for text in line.split()[2:]] for line in takeovers]


@contextmanager
def started(program: Path, *arguments: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """Start the program, and return it with its first line."""
    command = [str(program), *arguments]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            yield process, process.stdout.readline().strip()
        finally:
            process.kill()


@pytest.fixture
def tcp_plc(programs):
    """The PLC on a loopback port."""
    with started(programs / "mapped_plc", "tcp") as (process, line):
        port = line.removeprefix("port ")
        yield MappedPlc(f"plc+modbus-tcp://127.0.0.1:{port}?map={MAP}", process)


@pytest.fixture
def rtu_plc(programs):
    """The PLC on a serial cable."""
    cable = SerialCable()
    try:
        with started(programs / "mapped_plc", "rtu", cable.far) as (process, line):
            assert line == "ready"
            options = f"baud=115200&parity=none&map={MAP}"
            yield MappedPlc(f"plc+modbus-rtu://{cable.near}?{options}", process)
    finally:
        cable.close()


@pytest.fixture(params=["tcp", "rtu"])
def plc(request):
    """The PLC, on both links."""
    return request.getfixturevalue(f"{request.param}_plc")


@pytest.fixture
def compared_plc(plc):
    """The PLC, whose map somebody has compared with the machine's screen."""
    with robolink.connect(plc.url) as controller:
        confirm_whole_map(controller)
    return plc


def values(*tools: ToolOffset) -> list[float]:
    """Return the PLC's printed lines about tools."""
    return [value for t in tools for value in (t.x_mm, t.y_mm, t.z_mm, t.u_deg)]


def test_tools_and_signals_are_read(plc):
    with robolink.connect(plc.url) as controller:
        assert controller.tools.read_all() == OLD
        assert controller.tools.selected() == 1
        status = controller.status()
    assert (status.remote, status.ready, status.fault) == (True, True, False)


def test_no_tool_is_written_by_a_map_that_nobody_has_compared(plc):
    with robolink.connect(plc.url) as controller:
        with pytest.raises(NotComparedError):
            controller.tools.write(1, NEW[1], expected=OLD[1])
        assert controller.tools.read_all() == OLD
    plc.end()
    assert plc.in_force == []


def test_a_tool_is_written_taken_over_and_read_back(compared_plc):
    with robolink.connect(compared_plc.url) as controller:
        receipt = controller.tools.write(1, NEW[1], expected=OLD[1])
        assert (receipt.before, receipt.read_back) == (OLD[1], NEW[1])
    with robolink.connect(compared_plc.url) as controller:
        assert controller.tools.read_all() == {1: NEW[1], 2: OLD[2]}
    compared_plc.end()
    assert compared_plc.in_force == [values(NEW[1], OLD[2])]


def test_two_tools_change_together(compared_plc):
    with robolink.connect(compared_plc.url) as controller:
        change_tools(controller, [Wanted(tool, NEW[tool], OLD[tool]) for tool in OLD])
        assert controller.tools.read_all() == NEW
    compared_plc.end()
    assert compared_plc.in_force == [values(NEW[1], OLD[2]), values(NEW[1], NEW[2])]


def test_a_refused_value_is_named_and_all_tools_are_as_before(compared_plc):
    wanted = [Wanted(1, NEW[1], OLD[1]), Wanted(2, TOO_FAR, OLD[2])]
    with robolink.connect(compared_plc.url) as controller:
        with pytest.raises(RejectedError, match="7, the offset is outside the limits"):
            change_tools(controller, wanted)
        assert controller.tools.read_all() == OLD
        assert controller.status().ready
    compared_plc.end()
    assert compared_plc.in_force[0] == values(NEW[1], OLD[2])
    assert compared_plc.in_force[-1] == values(OLD[1], OLD[2])
