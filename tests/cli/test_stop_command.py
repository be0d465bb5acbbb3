"""``robolink stop``: nothing delays it, and faults are reported once the robot has stopped."""

import json
import os
import socket
import subprocess
import sys
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import click
import pytest
from robolink_cli import entry, main
from robolink_cli.prompts import operator as _operator
from robolink_cli.prompts import questions as consent
from robolink_cli.stopping.request import FLAGS, VALUES, StopRequest, read_stop
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.fieldbus.modbus import serve_modbus_tcp
from robolink_simulators.hosting.streams.epson import serve_tcp
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

import robolink
from robolink import Secret
from robolink.config import glance_at_cell
from robolink.controllers import EpsonController
from robolink.errors import OutcomeUnknownError
from robolink.journal import close_files, open_journal
from robolink.model import MotionProfile, WorkBox
from robolink.model import Path as MovePath
from robolink.stopping import StopListener, find_note
from robolink.transport import far_end_of, parse_url

CREEPING = MotionProfile(MovePath.STRAIGHT, 5, 1.0)


@pytest.fixture
def moving(state_folder):
    """An EPSON robot on the network that creeps for 30 s after its client has left."""
    simulator = EpsonSimulator(seed=4)
    with serve_tcp(simulator, clock=ScaledClock(1.0)) as host:
        controller = robolink.connect(host.url)
        controller.motors(True)
        here = controller.groups[0].pose()
        controller.groups[0].move_to(replace(here, z_mm=here.z_mm + 30), CREEPING, box=WorkBox())
        assert isinstance(controller, EpsonController)
        controller._link.session.close()
        controller.outcomes.close()  # the lease of the dead client
        simulator.url = host.url
        yield simulator
        controller._link.session.close()  # the handler for Ctrl-C is restored
        close_files()


@pytest.fixture
def stop(moving, capsys):
    """Run ``stop`` and return the exit code and the output; the arm must have stopped."""

    def ran(*arguments):
        code = entry.run([*(arguments or ("-c", moving.url)), "stop"])
        shown = capsys.readouterr()
        assert not moving.machine.arm.moving, shown
        return code, shown.out, shown.err

    return ran


def test_it_stops_and_says_that_it_stands(moving, stop):
    code, out, err = stop()
    assert code == 0
    assert out == f"{moving.url}: the robot has stopped (confirmed). State: ready.\n"
    assert "Commands with --yes are blocked until" in err
    assert "without a clear answer" in err  # the movement of the dead client


def test_its_document(moving, stop):
    code, out, _ = stop("-c", moving.url, "--json")
    assert code == 0
    assert json.loads(out) == {
        "schema": "robolink/stop/1",
        "stopped": True,
        "controller": moving.url,
        "state": "ready",
        "stopped_by": None,
    }


def test_a_journal_of_garbage_is_told_afterwards_and_truly(moving, stop, state_folder):
    close_files()
    for file in state_folder.glob("journal.db*"):
        file.unlink()
    (state_folder / "journal.db").write_bytes(b"no database" * 100)
    code, out, err = stop()
    assert code == 0
    assert "has stopped" in out
    assert "journal" in err
    assert "The stop went out anyway." in err
    assert "not touched" not in out + err


CELL = '[cells.a]\nurl = "{url}"\n{more}'


@pytest.mark.parametrize(
    "more", ["", "no_such_key = 1", "speed_mm_s = 'fast'", "[cells.b]\nurl = 7"]
)
def test_of_the_cell_file_only_the_address_has_to_be_right(moving, stop, more):
    Path("robolink.toml").write_text(CELL.format(url=moving.url, more=more))
    assert stop("-c", "a")[0] == 0


def test_a_cell_file_that_is_broken_leaves_the_address_of_the_last_connection(moving, stop, capsys):
    assert stop()[0] == 0
    Path("robolink.toml").write_text(CELL.format(url=moving.url, more=""))
    assert main.run(["-c", "a", "status"]) == 0
    Path("robolink.toml").write_text(CELL.format(url=moving.url, more="[[["))
    capsys.readouterr()
    code, out, err = stop("-c", "a")
    assert code == 0
    assert moving.url in out
    assert "robolink.toml cannot be read" in err
    assert f"The address is from the last connection: {moving.url}." in err


@pytest.mark.parametrize("command", [["status"], ["where"], ["motors", "off"], ["reset", "--yes"]])
def test_what_looks_or_calms_works_with_broken_files_too(
    moving, stop, state_folder, command, capsys
):
    Path("robolink.toml").write_text(CELL.format(url=moving.url, more=""))
    assert stop("-c", "a")[0] == 0
    assert main.run(["-c", "a", "status"]) == 0
    close_files()
    for file in state_folder.glob("journal.db*"):
        file.unlink()
    (state_folder / "journal.db").write_bytes(b"no database" * 100)
    Path("robolink.toml").write_text(CELL.format(url=moving.url, more="[[["))
    capsys.readouterr()
    assert main.run(["-c", "a", *command]) == 0
    assert "cannot be read" in capsys.readouterr().err
    assert main.run(["-c", "a", "motors", "on"]) == 2  # a movement is refused


def test_a_lease_that_another_holds_is_no_matter(moving, stop):
    identity = parse_url(moving.url).identity
    with open_journal().log(identity).hold("a long change"):
        assert stop()[0] == 0


def test_a_state_folder_that_is_none_is_no_matter(moving, stop, tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "file"))
    code, out, err = stop()
    assert (code, "has stopped" in out) == (0, True)
    assert "This stop could not be recorded" in err


def test_a_password_file_that_others_may_read_does_not_keep_it_back(moving, stop, tmp_path):
    (tmp_path / "password").write_text("x")
    (tmp_path / "password").chmod(0o644)
    code, _, err = stop("-c", moving.url, "--password-file", str(tmp_path / "password"))
    assert code == 0
    assert "Other users may read" in err


@pytest.mark.parametrize(
    "how", ["password_file = 'secret'", "password_env = 'ROBOLINK_PASSWORD_A'"]
)
@pytest.mark.parametrize("broken", [False, True])
def test_the_password_is_where_the_cell_says(state_folder, tmp_path, monkeypatch, how, broken):
    (tmp_path / "secret").write_text("canary-right\n")
    (tmp_path / "secret").chmod(0o600)
    monkeypatch.setenv("ROBOLINK_PASSWORD", "another cell's")
    monkeypatch.setenv("ROBOLINK_PASSWORD_A", "canary-right")
    with serve_tcp(EpsonSimulator(seed=4, password=Secret("canary-right"))) as host:
        cell = Path("robolink.toml")
        cell.write_text(CELL.format(url=host.url, more=how))
        assert main.run(["-c", "a", "status"]) == 0
        if broken:
            cell.write_text(CELL.format(url=host.url, more="[["))
        assert entry.run(["-c", "a", "stop"]) == 0
        assert main.run(["-c", "a", "status"]) == 0
    close_files()


def test_the_password_file_of_the_environment_counts_with_a_url(
    state_folder, tmp_path, monkeypatch
):
    (tmp_path / "secret").write_text("canary-right\n")
    (tmp_path / "secret").chmod(0o600)
    monkeypatch.setenv("ROBOLINK_PASSWORD_FILE", str(tmp_path / "secret"))
    with serve_tcp(EpsonSimulator(seed=4, password=Secret("canary-right"))) as host:
        assert entry.run(["-c", host.url, "stop"]) == 0


def test_the_recording_is_written_afterwards(moving, stop, tmp_path):
    assert stop("-c", moving.url, "--record", str(tmp_path / "talk"))[0] == 0
    talk = (tmp_path / "talk").read_text()
    assert talk.index("$Abort") < talk.index("$Stop") < talk.index("$GetStatus")
    assert stop("-c", moving.url, "--record", str(tmp_path / "no" / "talk"))[0] == 0


def test_a_wrong_password_in_the_environment_gives_way_to_the_keyring(
    state_folder, monkeypatch, capsys
):
    keyring = SimpleNamespace(get_password=lambda service, user: "canary-right")
    monkeypatch.setitem(sys.modules, "keyring", keyring)
    monkeypatch.setitem(sys.modules, "keyring.errors", SimpleNamespace(KeyringError=OSError))
    monkeypatch.setenv("ROBOLINK_PASSWORD", "canary-wrong")
    with serve_tcp(EpsonSimulator(seed=4, password=Secret("canary-right"))) as host:
        assert entry.run(["-c", host.url, "stop"]) == 0
        keyring.get_password = lambda service, user: None
        assert entry.run(["-c", host.url, "stop"]) == 5
    assert "refused the login" in capsys.readouterr().err


def test_a_keyring_that_fails_in_a_way_of_its_own_does_not_keep_it_back(moving, stop, monkeypatch):
    def fails(_service, _user):
        raise RuntimeError("D-Bus is not there")

    monkeypatch.setitem(sys.modules, "keyring", SimpleNamespace(get_password=fails))
    monkeypatch.setitem(sys.modules, "keyring.errors", SimpleNamespace(KeyringError=OSError))
    code, _, err = stop()
    assert code == 0
    assert "The system's keyring failed: RuntimeError: D-Bus is not there." in err
    assert "The stop went out anyway." in err


class Unclear:
    """A controller locked by another client, whose stop is not answered."""

    def stop(self):
        raise OutcomeUnknownError("sent, not answered")

    def status(self):
        raise AssertionError


@pytest.mark.parametrize("kind", ["softmotion+modbus-tcp", "epson+tcp"])
def test_what_a_holder_sent_without_an_answer_leaves_a_note(
    state_folder, kind, monkeypatch, capsys
):
    monkeypatch.setenv("ROBOLINK_PASSWORD", "canary-wrong")
    with ExitStack() as stack:
        if kind == "epson+tcp":  # it answers, and refuses
            simulator = EpsonSimulator(seed=4, password=Secret("canary-right"))
            url = stack.enter_context(serve_tcp(simulator)).url
        else:  # nobody answers
            taken = stack.enter_context(socket.socket())
            taken.bind(("127.0.0.1", 0))
            url = f"{kind}://127.0.0.1:{taken.getsockname()[1]}"
        stack.enter_context(StopListener(Unclear(), url))
        assert entry.run(["-c", url, "stop", "--timeout", "0.5"]) == 6
    assert "sent, not answered" in capsys.readouterr().err
    found = find_note(far_end_of(url))
    assert found is not None
    assert not found.confirmed


def test_nobody_there_is_told_and_leaves_no_note(state_folder, capsys):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        url = f"epson+tcp://127.0.0.1:{taken.getsockname()[1]}"
        assert entry.run(["-c", url, "stop", "--timeout", "0.5"]) == 3
        assert "press the emergency stop" in capsys.readouterr().err
        assert find_note(far_end_of(url)) is None
        assert entry.run(["-c", url, "stop", "--timeout", "0.5", "--json"]) == 3
        assert json.loads(capsys.readouterr().out)["error"]["kind"] == "ConnectError"


def test_a_note_holds_the_next_movement_until_somebody_releases_it(moving, stop, capsys):
    assert stop("-c", moving.url, "--operator", "anna")[0] == 0
    assert main.run(["-c", moving.url, "recover", "--yes"]) == 0
    localhost = moving.url.replace("127.0.0.1", "localhost")
    jog = ["jog", "x+1", "--yes", "-c"]
    started = moving.machine.arm.moves_started
    capsys.readouterr()
    for url in (moving.url, localhost):
        assert main.run([*jog, url]) == 10
        assert "anna (process" in capsys.readouterr().err
    assert moving.machine.arm.moves_started == started
    assert main.run(["-c", localhost, "release", "--yes", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["released"] is True
    assert main.run([*jog, moving.url]) == 0
    assert moving.machine.arm.moves_started == started + 1
    assert main.run(["-c", localhost, "release"]) == 0
    assert "No stop is on record" in capsys.readouterr().out


class Person:
    """A person at a terminal who answers every question alike."""

    def __init__(self, answer):
        self.answer, self.questions = answer, []

    def ask(self, question, kind):
        self.questions.append(question)

    def poll(self, wait_s):
        return self.answer


@pytest.mark.parametrize(("answer", "code"), [("n", 9), ("y", 0)])
def test_a_person_is_shown_who_stopped_it_and_asked(
    moving, stop, capsys, monkeypatch, answer, code
):
    assert stop("-c", moving.url, "--operator", "anna")[0] == 0
    assert main.run(["-c", moving.url, "resolve", "--yes"]) == 0
    started, person = moving.machine.arm.moves_started, Person(answer)
    monkeypatch.setattr(consent, "person_here", lambda: True)
    monkeypatch.setattr("robolink_cli.session.motion_consent.person_here", lambda: True)
    monkeypatch.setattr("robolink_cli.stopping.notes.person_here", lambda: True)
    monkeypatch.setattr(_operator, "terminal", lambda: person)
    capsys.readouterr()
    assert main.run(["jog", "x+1", "-c", moving.url]) == code
    assert "anna (process" in capsys.readouterr().err
    assert "may the robot move again" in person.questions[0]
    moves = answer == "y"
    assert len(person.questions) == (2 if moves else 1)  # the second is that of every movement
    assert moving.machine.arm.moves_started == started + moves
    assert (find_note(far_end_of(moving.url)) is None) is moves


def test_a_reset_takes_the_note_away_too(moving, stop):
    assert stop()[0] == 0
    assert find_note(far_end_of(moving.url)) is not None
    assert main.run(["-c", moving.url, "reset", "--yes"]) == 0
    assert find_note(far_end_of(moving.url)) is None


def test_a_note_that_cannot_be_read_is_a_note(moving, stop, state_folder, capsys):
    assert stop()[0] == 0
    for note in (state_folder / "stops").iterdir():
        note.write_bytes(b"{")
    assert main.run(["-c", moving.url, "recover", "--yes"]) == 0
    assert main.run(["jog", "x+1", "--yes", "-c", moving.url]) == 10
    assert "cannot be read" in capsys.readouterr().err
    assert main.run(["-c", moving.url, "release", "--yes"]) == 0
    assert main.run(["jog", "x+1", "--yes", "-c", moving.url]) == 0


def test_what_is_read_by_hand_is_what_click_knows():
    context = click.Context(main.cli)
    command = main.cli.get_command(context, "stop")
    assert command is not None
    options = {name: parameter for parameter in command.params for name in parameter.opts}
    flags = {name for name, parameter in options.items() if getattr(parameter, "is_flag", False)}
    assert set(VALUES) == set(options) - flags
    assert set(FLAGS) == flags - {"--dry-run"}


@pytest.mark.parametrize(
    ("words", "read"),
    [
        ("stop", StopRequest()),
        ("-c a stop", StopRequest("a")),
        ("stop -c a --json", StopRequest("a", json=True)),
        ("-c b stop --controller=a", StopRequest("a")),
        ("--timeout 2 stop", StopRequest(timeout_s=2.0)),
        ("--remote-timeout 5 stop --operator stop", StopRequest(operator="stop")),
        ("stop --record x --password-file y", StopRequest(record="x", password_file="y")),
        ("stop now", None),
        ("stop --help", None),
        ("stop --dry-run", None),
        ("stop --timeout 0", None),
        ("stop --timeout x", None),
        ("stop -c", None),
        ("jog stop", None),
        ("-c stop status", None),
        ("stop --no-such", None),
        ("stop -ca", None),
    ],
)
def test_how_a_command_line_is_read(words, read, monkeypatch):
    monkeypatch.delenv("ROBOLINK_OPERATOR", raising=False)
    assert read_stop(words.split()) == read


def test_the_environment_names_the_controller(monkeypatch):
    monkeypatch.setenv("ROBOLINK_CONTROLLER", "a")
    monkeypatch.setenv("ROBOLINK_OPERATOR", "anna")
    assert read_stop(["stop"]) == StopRequest("a", operator="anna")


HEAVY = """
asyncua can canopen click jinja2 keyring lark numpy pydantic pymodbus rich sqlite3 logging
asyncio robolink.journal robolink.calibration robolink.controllers.epson.controller
robolink.controllers.softmotion.controller
"""

PROBE = """
import sys
from robolink_cli.stopping.request import read_stop
from robolink_cli.stopping.stop_first import stop_first
outcome = stop_first(read_stop(["-c", "a", "stop"]))
assert outcome.error is None, outcome.error
print(*sorted(set(sys.argv[1:]) & set(sys.modules)), sep=",")
"""


OF_ASYNCUA = {"asyncio", "asyncua", "logging"}


@pytest.mark.parametrize("kind", ["epson", "modbus", pytest.param("opcua", marks=pytest.mark.soak)])
def test_nothing_heavy_is_loaded_before_the_robot_stands(state_folder, kind):
    expected = set()
    with ExitStack() as stack:
        if kind == "epson":
            url = stack.enter_context(serve_tcp(EpsonSimulator(seed=4))).url
        elif kind == "modbus":
            url = stack.enter_context(serve_modbus_tcp(SoftMotionSimulator(seed=4))).url
        else:
            from robolink_simulators.hosting.fieldbus.opcua import serve_opcua

            url = stack.enter_context(serve_opcua(SoftMotionSimulator(seed=4))).url
            expected = OF_ASYNCUA
        Path("robolink.toml").write_text(CELL.format(url=url, more=""))
        done = subprocess.run(
            [sys.executable, "-c", PROBE, *HEAVY.split()],
            check=False,
            capture_output=True,
            text=True,
            timeout=30,
            env={**os.environ, "ROBOLINK_STATE_DIR": str(state_folder)},
        )
    assert (done.stdout, done.stderr) == (",".join(sorted(expected)) + "\n", "")


WHOLE = """
robot = "T6-602S"
tool = 2
people = { "4711" = "operator", "Anna" = "engineer" }
remote_timeout_s = 60.0
remote_timeout_confirmed_by = "Anna"
max_change_mm = 1.5
box_mm = 30.0
[cells.a.stations.post]
kind = "pin"
"""


@pytest.mark.parametrize("more", ["", "timeout_s = 2.5", WHOLE])
def test_a_cell_file_is_checked_anew_for_a_look_when_it_changed(moving, stop, capsys, more):
    assert stop()[0] == 0
    cell = Path("robolink.toml")
    cell.write_text(CELL.format(url=moving.url, more=more))
    assert glance_at_cell("a") is None
    for _ in range(2):
        assert main.run(["-c", "a", "status"]) == 0
        assert glance_at_cell("a") is not None
    cell.write_text(CELL.format(url=moving.url, more="no_such_key = 1\n" + more))
    assert glance_at_cell("a") is None
    capsys.readouterr()
    assert main.run(["-c", "a", "status"]) == 0
    assert "no_such_key" in capsys.readouterr().err
    cell.write_text(CELL.format(url=moving.url, more="robot = 'LS10-B'"))
    assert main.run(["-c", "a", "status"]) == 0
    assert "needs robot LS10-B" in capsys.readouterr().err


def test_a_look_that_does_not_check_the_cell_file_heeds_what_it_says(moving, stop, capsys):
    assert stop()[0] == 0
    more = WHOLE.replace("T6-602S", "LS10-B")
    Path("robolink.toml").write_text(CELL.format(url=moving.url, more=more))
    for known in (False, True):
        assert (glance_at_cell("a") is not None) is known
        capsys.readouterr()
        assert main.run(["-c", "a", "status"]) == 0
        told = capsys.readouterr().err
        assert "Cell a needs robot LS10-B" in told
        assert "the cell a uses tool 2" in told
        assert main.run(["-c", "a", "--operator", "Anna", "status"]) == 0
        assert main.run(["-c", "a", "--operator", "nobody", "status"]) == 2
        assert "not among the people of this cell" in capsys.readouterr().err


LOOK = """
import sys
from robolink_cli import entry
assert entry.run(["-c", "a", "status"]) == 0
print("loaded:", *sorted(set(sys.argv[1:]) & set(sys.modules)))
"""


def test_the_cell_file_of_a_shop_makes_no_look_load_what_checks_it(moving, stop):
    assert stop()[0] == 0
    Path("robolink.toml").write_text(CELL.format(url=moving.url, more=WHOLE))
    assert main.run(["-c", "a", "status"]) == 0
    done = subprocess.run(
        [sys.executable, "-c", LOOK, "pydantic", "numpy", "rich"],
        check=False,
        capture_output=True,
        text=True,
        timeout=30,
        env=dict(os.environ),
    )
    assert done.stdout.endswith("loaded:\n"), done
