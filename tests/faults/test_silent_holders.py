"""A process that has a controller and does not respond: named, and ended once the robot stands.

The processes and the sockets are real; the silence is made, by a process whose clock is behind.
"""

import io
import json
import signal
import subprocess
import sys
import threading
import time
from dataclasses import replace

import pytest
from robolink_cli import main
from robolink_cli.prompts import questions
from robolink_cli.session.take_over import holder_of
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.faults import PlcFault, PlcFaultAction
from robolink_simulators.hosting.fieldbus.modbus import serve_modbus_tcp
from robolink_simulators.hosting.streams.epson import serve_serial, serve_tcp
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

from robolink.errors import BusyError
from robolink.journal import close_files, open_journal, this_process
from robolink.model import EntryKind, ToolOffset
from robolink.stopping import end_process, holders_of
from robolink.transport import far_end_of
from tests._patience import PATIENCE_S
from tests.faults._client_process import ClientProcess
from tests.faults._holding_process import HoldingProcess

SOAK = pytest.mark.soak
OLD, NEW = ToolOffset(12.0, -3.5, -20.0), ToolOffset(12.5, -3.5, -20.0)
SET = ("tool", "set", "1", "--x", "12.5", "--order", "A-17", "--yes")
JOB = {"command": "tool set", "options": {"number": "1", "x": "12.5"}}


class Epson:
    url = ""
    written = 0

    def __init__(self):
        self.simulator = EpsonSimulator(seed=4)
        self.simulator.machine.tools.set(1, OLD)

    def served(self):
        return serve_tcp(self.simulator)


class Plc:
    url = ""

    def __init__(self):
        self.simulator = SoftMotionSimulator(seed=4)

    def served(self):
        return serve_modbus_tcp(self.simulator, clock=ScaledClock(1.0))


@pytest.fixture
def state(tmp_path, monkeypatch):
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
    monkeypatch.chdir(tmp_path)
    yield tmp_path / "state"
    close_files()


@pytest.fixture
def epson(state):
    cell = Epson()
    cell.written = cell.simulator.machine.flash_writes
    with cell.served() as host:
        cell.url = host.url
        yield cell


@pytest.fixture
def plc(state):
    cell = Plc()
    with cell.served() as host:
        cell.url = host.url
        yield cell


@pytest.fixture
def person(monkeypatch):
    """A person at the terminal, who answers line by line; shows what was asked."""
    lines: list[str] = []
    for module in ("prompts.questions", "session.take_over", "commands.record.recovery_guide"):
        monkeypatch.setattr(f"robolink_cli.{module}.person_here", lambda: True)
    monkeypatch.setattr(questions, "_answer", lambda: lines.pop(0))
    monkeypatch.setattr("sys.stdin", io.StringIO())
    return lines


@pytest.fixture
def held(state):
    """Start processes that have the cell, and end them all."""
    started = []

    def hold(cell, order=("A-17", JOB), **how):
        started.append(HoldingProcess(cell.url, state, order, NEW, **how))
        return started[-1]

    yield hold
    for process in started:
        process.close()


class Terminal:
    """Types commands; ``took_s`` is how long the last one took."""

    took_s = 0.0

    def __init__(self, capsys):
        self._capsys = capsys

    def __call__(self, cell, *words):
        began_s = time.monotonic()
        code = main.run(["-c", cell.url, *words])
        self.took_s = time.monotonic() - began_s
        shown = self._capsys.readouterr()
        return code, " ".join((shown.out + shown.err).split())


@pytest.fixture
def types(capsys):
    return Terminal(capsys)


@pytest.mark.fault("F79")
@pytest.mark.parametrize("order", ["A-17", pytest.param("B-2", marks=SOAK)])
def test_f79_beside_a_delivery_at_work_another_ends_with_5_and_connects_to_nobody(
    epson, held, types, order
):
    first = held(epson)
    connected = len(epson.simulator.log)
    code, said = types(epson, *SET[:-2], order, "--yes")
    assert code == 5, said
    assert f"process {first.pid} on" in said
    assert "Ann Lee" in said
    assert "since" in said
    assert len(epson.simulator.log) == connected
    first.freeze()
    assert types(epson, *SET)[0] == 5
    assert types.took_s < 1
    first.thaw()
    assert first.goes_on() == "done"
    code, said = types(epson, *SET)
    assert (code, "was carried out" in said) == (0, True), said


@pytest.mark.fault("F79")
def test_f79_a_silent_holder_is_named_with_what_to_type(epson, held, types):
    first = held(epson, silent_s=20)
    first.freeze()
    for words in (SET, ("tool", "set", "2", "--x", "1", "--yes"), ("tool", "backup", "kept.json")):
        code, said = types(epson, "--timeout", "0.3", *words)
        assert code == 5, said
        assert f"process {first.pid} on" in said
        assert "has not responded for 2" in said
        assert "robolink recover --take-over REASON" in said
    first.thaw()
    assert first.goes_on() == "done"


def test_who_is_logged_in_without_the_lease_is_named_too(epson, held, types):
    first = held(epson, begun=False)
    code, said = types(epson, "--timeout", "0.3", *SET)
    assert code == 5, said
    assert f"process {first.pid} on" in said
    assert "Ann Lee ('robolink change')" in said
    assert "since" in said


@SOAK
def test_who_has_the_serial_line_is_named(state, held, types):
    simulator = EpsonSimulator(seed=4)
    with serve_serial(simulator) as host:
        cell = Epson()
        cell.url = host.url
        first = held(cell, begun=False)
        code, said = types(cell, "tool", "set", "2", "--x", "1", "--yes")
        assert code == 5, said
        assert f"process {first.pid} on" in said


@pytest.mark.fault("F79")
def test_f79_whoever_waited_for_a_login_until_the_first_had_ended_is_told_its_result(
    epson, held, types
):
    first = held(epson, begun=False)
    ends = threading.Timer(0.2, first.goes_on)
    ends.start()
    code, said = types(epson, "--timeout", "1.5", *SET)
    ends.join()
    assert (code, "was carried out" in said) == (0, True), said
    assert types.took_s > 1.5
    assert epson.simulator.machine.flash_writes == epson.written + 1


def marked(*kinds):
    return [entry for entry in open_journal().entries(kinds=kinds) if "ended" in entry.details]


HEARS_THE_STOP = ("StoppedError", "done")
"""How a frozen process ends that comes back: the stop waits for it, beside what it was doing."""

TAKE_OVER = ("recover", "--take-over", "the window hangs")


def test_nobody_there_means_no_proof_of_rest_and_nothing_is_ended(epson, held, types):
    first = held(epson, silent_s=20)
    first.freeze()
    code, said = types(epson, "--timeout", "0.3", *TAKE_OVER)
    assert code == 6, said
    assert "Press the emergency stop" in said
    assert "did not end Ann Lee (" in said
    assert first.exit_code is None
    first.thaw()
    assert first.goes_on() in HEARS_THE_STOP


@pytest.mark.parametrize(
    ("answers", "code"),
    [pytest.param(["n"], 9, marks=SOAK), (["y", "n"], 6), (["y", "y"], 0)],
    ids=["not agreed", "not seen at rest", "seen at rest"],
)
def test_a_person_who_has_seen_the_robot_at_rest_may_end_it(
    epson, held, types, person, answers, code
):
    first = held(epson, silent_s=20)
    first.freeze()
    person.extend(answers)
    ended, said = types(epson, "--timeout", "0.3", *TAKE_OVER)
    assert ended == code, said
    assert f"process {first.pid} on" in said
    assert person == []
    if code:
        assert first.exit_code is None
        first.thaw()
        assert first.goes_on() in (HEARS_THE_STOP if code == 6 else ("done",))
        return
    assert first.exit_code == -signal.SIGKILL
    assert "the robot has stopped (confirmed)" in said
    assert open_journal().open_markers() == ()
    (taken,) = marked(EntryKind.LEASE)
    assert "the window hangs" in taken.verdict
    assert "pressed the emergency stop" in taken.verdict
    assert taken.details["ended"]["pid"] == first.pid
    # What it had written was complete, so its order counts; the stop is still to be released.
    assert types(epson, *SET)[0] == 0
    assert types(epson, "jog", "x+1", "--yes")[0] == 10
    assert epson.simulator.machine.flash_writes == epson.written + 1


def test_a_plc_shows_its_rest_itself(plc, held, types):
    first = held(plc, silent_s=20)
    first.freeze()
    code, said = types(plc, *SET)
    assert (code, "has not responded for 2" in said) == (5, True), said
    code, said = types(plc, *TAKE_OVER)
    assert code == 0, said
    assert first.exit_code == -signal.SIGKILL
    assert "the robot has stopped (confirmed)" in said
    (taken,) = marked(EntryKind.LEASE)
    assert "The controller showed" in taken.verdict
    assert open_journal().open_markers() == ()


def test_a_process_that_has_other_controllers_too_is_not_ended(plc, held, types):
    """An agent has sixteen: of the others nobody knows whether they stand still."""
    first = held(plc, silent_s=20)
    (one,) = holders_of(far_end_of(plc.url))
    said = json.loads(one.card.read_bytes())
    other = one.card.with_name(f"{first.pid}-ffffffff.json")
    other.write_text(json.dumps(said | {"keys": ["epson 192.0.2.7 5000"], "controller": ""}))
    first.freeze()
    code, told = types(plc, *TAKE_OVER)
    assert code == 6, told
    assert "epson 192.0.2.7 5000" in told
    assert "No process was ended" in told
    assert first.exit_code is None
    other.unlink()
    assert types(plc, *TAKE_OVER)[0] == 0
    assert first.exit_code == -signal.SIGKILL


def test_a_plc_that_does_not_show_its_rest_keeps_its_client(plc, held, types, person):
    """It was reached and told to stop: a person's word does not count against its silence."""
    first = held(plc, silent_s=20)
    first.freeze()
    lost = PlcFault(PlcFaultAction.DROP_REPLY, match="read_response", every=1)
    plc.simulator.faults.add(lost)
    person.append("y")
    code, said = types(plc, "--timeout", "0.2", *TAKE_OVER)
    assert code == 6, said
    assert "press the emergency stop" in said.lower()
    assert (person, first.exit_code) == ([], None)


@SOAK
def test_a_process_that_responds_may_clean_up_and_is_not_killed(epson, held, types, person):
    first = held(epson)
    person.append("y")
    code, said = types(epson, *TAKE_OVER)
    assert code == 0, said
    assert first.exit_code == -signal.SIGTERM
    assert "was working on it, and stopped it" in said


def test_a_number_that_another_process_has_by_now_is_left_alone(epson, types):
    bystander = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    here = this_process()
    namespace, _, start = here.process_start.partition(" ")
    of_before = replace(here, pid=bystander.pid, process_start=f"{namespace} {int(start) - 1}")
    try:
        with open_journal().log(epson.url, holder=of_before).hold("an earlier job"):
            assert holder_of(epson.url) is None
            assert types(epson, *TAKE_OVER)[0] == 0
        end_process(of_before)
        with pytest.raises(BusyError, match="cannot tell"):
            end_process(replace(of_before, boot="another computer"))
        with pytest.raises(BusyError, match="cannot tell"):
            end_process(here)
        assert bystander.poll() is None
    finally:
        bystander.communicate(b"")


@SOAK
@pytest.mark.fault("F79")
@pytest.mark.parametrize("kind", ["epson", "plc"])
def test_f79_a_delivery_that_is_frozen_for_12_s_is_named_and_goes_on(request, held, types, kind):
    cell = request.getfixturevalue(kind)
    first = held(cell)
    first.freeze()
    time.sleep(2)
    code, said = types(cell, *SET)
    assert (code, "Last response: 2 s ago" in said or "Last response: 3 s ago" in said) == (5, True)
    time.sleep(10)
    code, said = types(cell, *SET)
    assert code == 5, said
    assert f"process {first.pid} on" in said
    assert "has not responded for 1" in said
    first.thaw()
    assert first.goes_on() == "done"
    code, said = types(cell, *SET)
    assert (code, "was carried out" in said) == (0, True), said


@SOAK
@pytest.mark.fault("F79")
def test_f79_of_twenty_pairs_of_deliveries_at_once_none_ends_with_3(epson, tmp_path):
    """Both start at the same instant: one carries it out, the other is told who, or its result."""
    for number in range(20):
        words = ("tool", "set", "1", "--x", f"{12 + number / 10}", "--order", f"A-{number}")
        pair = []
        for name in ("one", "two"):
            folder = tmp_path / f"{name}-{number}"
            folder.mkdir()
            pair.append(
                ClientProcess(
                    ("-c", epson.url, *words, "--yes"),
                    environment={"ROBOLINK_STATE_DIR": str(tmp_path / "state")},
                    folder=folder,
                )
            )
        codes = sorted(process.exit_code() for process in pair)
        assert codes in ([0, 0], [0, 5]), [process.err for process in pair]
        # 12.0 stood there already
        assert epson.simulator.machine.flash_writes == epson.written + number


@SOAK
def test_a_robot_that_moves_on_is_stopped_once_its_frozen_client_is_ended(
    state, types, person, tmp_path
):
    """The person was wrong: it moved still."""
    simulator = EpsonSimulator(seed=4)
    simulator.machine.switch_motors(True)
    cell = Epson()
    with serve_tcp(simulator, clock=ScaledClock(0.25)) as host:
        cell.url, began_mm = host.url, simulator.machine.arm.flange().x_mm
        jog = ClientProcess(
            ("-c", cell.url, "jog", "x-5", "--speed", "1", "--yes"),
            environment={"ROBOLINK_STATE_DIR": str(state)},
            folder=tmp_path,
        )
        deadline = time.monotonic() + PATIENCE_S
        while not simulator.machine.arm.moving:
            assert time.monotonic() < deadline, jog.err
            time.sleep(0.005)
        jog.signal(signal.SIGSTOP)
        person += ["y", "y", "y"]
        code, said = types(cell, "--timeout", "0.5", *TAKE_OVER)
        assert code == 0, said
        assert jog.exit_code() == -signal.SIGKILL
        assert not simulator.machine.arm.moving
        assert simulator.machine.arm.flange().x_mm > began_mm - 4.5
        assert "the robot has stopped (confirmed)" in said
        assert open_journal().open_markers() == ()
