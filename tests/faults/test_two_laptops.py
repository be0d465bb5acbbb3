"""Two computers on one controller that share no journal.

docs/security.md, "Two laptops on one controller", makes the statements tested here.

The second computer has its own state folder and types commands: in the same process while the first
is connected, and in ``make soak`` in a separate process. The tests show what the controller itself
keeps apart, and what it does not.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from robolink_cli import main
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.faults import Fault, FaultAction
from robolink_simulators.hosting.fieldbus.modbus import serve_modbus_tcp
from robolink_simulators.hosting.streams.epson import serve_tcp
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

import robolink
from robolink.controllers import SoftMotionController
from robolink.errors import NotReadyError, RejectedError, ToolChangedError
from robolink.journal import close_files
from robolink.model import MotionProfile, ToolOffset, WorkBox
from robolink.protocols.mailbox import (
    Command,
    ErrorClass,
    Opcode,
    encode_command,
    heartbeat_word,
    next_number,
)
from robolink.transport import open_mailbox_link, parse_url
from tests._patience import PATIENCE_S

OLD, MINE = ToolOffset(12.0, -3.5, -20.0), ToolOffset(12.1, -3.5, -20.0)


class Laptop:
    """Another computer, with another journal."""

    def __init__(self, folder: Path, url: str, capsys, monkeypatch, *, apart: bool) -> None:
        self.folder, self.url, self.apart = folder, url, apart
        self._capsys, self._monkeypatch = capsys, monkeypatch
        folder.mkdir()

    def types(self, *words):
        """Return the exit code and the document of a command typed there."""
        close_files()
        ended = self._typed(words)
        close_files()
        return ended

    def _typed(self, words):
        with self._monkeypatch.context() as there:
            there.setenv("ROBOLINK_STATE_DIR", str(self.folder / "state"))
            code = main.run(["-c", self.url, "--json", *words])
        return code, json.loads(self._capsys.readouterr().out)

    def types_meanwhile(self, *words):
        """The same while this computer is connected: its journal stays open."""
        if not self.apart:
            return self._typed(words)
        clean = {k: v for k, v in os.environ.items() if not k.startswith("ROBOLINK")}
        done = subprocess.run(
            [sys.executable, "-m", "robolink_cli", "-c", self.url, "--json", *words],
            cwd=self.folder,
            env={**clean, "ROBOLINK_STATE_DIR": str(self.folder / "state")},
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=PATIENCE_S,
            check=False,
        )
        return done.returncode, json.loads(done.stdout)


@pytest.fixture(autouse=True)
def _this_computer(tmp_path, monkeypatch):
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "this" / "state"))


@pytest.fixture
def apart():
    """Whether the other laptop has its own process beside a connection of this one."""
    return False


in_both_ways = pytest.mark.parametrize(
    "apart",
    [False, pytest.param(True, marks=pytest.mark.soak)],
    ids=["one process", "two processes"],
)


@pytest.fixture
def laptop(tmp_path, capsys, monkeypatch, apart):
    return lambda name, url: Laptop(tmp_path / name, url, capsys, monkeypatch, apart=apart)


@pytest.fixture
def epson(laptop):
    simulator = EpsonSimulator(seed=4)
    simulator.machine.tools.set(1, OLD)
    with serve_tcp(simulator) as host:
        yield simulator, host.url, laptop("other", host.url)


@pytest.fixture
def plc(laptop):
    simulator = SoftMotionSimulator(seed=3)
    with serve_modbus_tcp(simulator, clock=ScaledClock(1.0)) as host:
        yield simulator, host.url, laptop("other", host.url)


# ---- EPSON: one client is served at a time


@in_both_ways
def test_an_epson_controller_serves_one_laptop_the_other_can_not_even_look(epson):
    simulator, url, other = epson
    with robolink.connect(url) as mine:
        mine.tools.write(1, MINE, expected=OLD)
        code, document = other.types_meanwhile("--timeout", "0.5", "tool", "list")
        assert code == 3, document
        assert document["error"]["controller_state"] == "unchanged"
        code, document = other.types_meanwhile("--timeout", "0.5", "stop")
        assert code == 3, document  # a stop is a command too: the emergency stop is not
        assert mine.tools.read(1) == MINE  # and the first client has noticed nothing
    assert simulator.machine.tools.get(1) == MINE


def test_an_epson_controller_takes_from_the_second_what_the_first_then_finds_changed(epson):
    simulator, url, other = epson
    with robolink.connect(url) as mine:
        seen = mine.tools.read(1)
    assert other.types("tool", "set", "1", "--x", "12.4", "--yes")[0] == 0
    with robolink.connect(url) as mine:
        with pytest.raises(ToolChangedError):
            mine.tools.write(1, MINE, expected=seen)
    assert simulator.machine.tools.get(1) == ToolOffset(12.4, -3.5, -20.0)


def test_an_undo_does_not_take_back_what_the_other_laptop_wrote(epson, laptop):
    simulator, _, other = epson
    third = laptop("third", other.url)
    assert third.types("tool", "set", "1", "--x", "12.2", "--yes")[0] == 0
    assert other.types("tool", "set", "1", "--x", "12.4", "--yes")[0] == 0
    code, document = third.types("undo", "--yes")
    assert code not in (0, 6), document
    assert simulator.machine.tools.get(1) == ToolOffset(12.4, -3.5, -20.0)


def test_what_one_laptop_must_settle_holds_up_that_laptop_and_not_the_other(laptop):
    lost = Fault(FaultAction.DROP_REPLY, match="TLSet 1, XY")
    simulator = EpsonSimulator(seed=4, faults=[lost])
    simulator.machine.tools.set(1, OLD)
    with serve_tcp(simulator) as host:
        one, other = laptop("one", host.url), laptop("other", host.url)
        assert one.types("--timeout", "0.5", "tool", "set", "1", "--x", "12.2", "--yes")[0] == 6
        assert one.types("jog", "x+1", "--yes")[0] == 6
        assert other.types("tool", "set", "1", "--x", "12.4", "--yes")[0] == 0
        one.types("recover", "--yes")
        assert simulator.machine.tools.get(1) == ToolOffset(12.4, -3.5, -20.0)


# ---- a PLC: the client that commands owns the mailbox


@in_both_ways
def test_a_plc_shows_everything_to_both_and_is_written_by_its_owner(plc):
    _, url, other = plc
    with robolink.connect(url) as mine:
        assert isinstance(mine, SoftMotionController)
        mine.take()
        before = mine.tools.read(1)
        with robolink.connect(url) as second:
            assert second.tools.read(1) == before
        code, document = other.types_meanwhile("tool", "set", "1", "--x", "12.4", "--yes")
        assert code == 5, document
        assert "commands the PLC" in document["error"]["what"]
        assert mine.tools.read(1) == before


@in_both_ways
def test_the_other_laptop_may_always_stop_a_plc(plc):
    simulator, url, other = plc
    with robolink.connect(url) as mine:
        assert isinstance(mine, SoftMotionController)
        mine.take()
        group = mine.groups[0]
        here = group.pose()
        assert other.types_meanwhile("stop")[0] == 0
        with pytest.raises(NotReadyError, match="held by a stop"):
            group.move_to(here, MotionProfile(), box=WorkBox())
    assert simulator.plc.group.movements_started == 0


@pytest.mark.soak
def test_a_person_at_the_other_laptop_may_take_a_plc_and_the_first_is_refused(plc):
    simulator, url, other = plc
    with robolink.connect(url) as mine:
        assert isinstance(mine, SoftMotionController)
        mine.take()
        seen = mine.tools.read(1)
        code, document = other.types_meanwhile("take-ownership", "--yes")
        assert code == 0, document
        with pytest.raises(RejectedError, match="another client, or nobody, owns") as refused:
            mine.tools.write(1, MINE, expected=seen)
    assert refused.value.code == ErrorClass.NOT_OWNER
    assert simulator.plc.memory.defined()[1].tool[0] == OLD.x_mm


def test_who_speaks_the_mailbox_himself_can_pretend_to_be_the_owner_and_is_found_out(plc):
    """Nothing on a field bus proves a client's identity: the page says so."""
    simulator, url, _ = plc
    with robolink.connect(url) as mine:
        assert isinstance(mine, SoftMotionController)
        mine.take()
        seen = mine.tools.read(1)
        ownership = simulator.plc.program.ownership
        link = open_mailbox_link(parse_url(url), timeout_s=2.0)
        forged = Command(
            next_number(link.read_response()[1]),
            Opcode.WRITE_TOOL,
            operands=(1, 0, 0, 0),
            pose=(11.0, 0.0, 0.0, 0.0, 0.0, 0.0),
            owner=ownership.holder,
            epoch=simulator.plc.memory.epoch,
        )
        link.write_command(encode_command(forged, heartbeat=heartbeat_word(forged.epoch, 1)))
        while link.read_response()[1] != forged.sequence:
            pass
        link.close()
        assert simulator.plc.memory.defined()[1].tool[0] == 11.0
        with pytest.raises(ToolChangedError):
            mine.tools.write(1, MINE, expected=seen)
