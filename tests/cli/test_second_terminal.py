"""A second terminal beside a working one, or beside production: its view, and its restraint."""

import json
import os
from dataclasses import replace

import pytest
from robolink_cli import main
from robolink_cli.commands.companions import spel
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.epson.condition import Task
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.fieldbus.modbus import serve_modbus_tcp
from robolink_simulators.hosting.in_process.epson import clock_of
from robolink_simulators.hosting.streams.epson import serve_serial, serve_tcp
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

import robolink
from robolink.journal import LeaseHolder, open_journal
from robolink.journal._lease_view import BootClock, this_process
from robolink.model import Marker, MarkerKind, Signature, ToolOffset
from robolink.stopping import StopListener
from robolink.timing import NS_PER_S

# A second terminal beside a working session: who it is, what it does, nothing to recover.

DETAILS = {"tool": 1, "now": 0}
MARKER = Marker("a", MarkerKind.SELECTION, "calibration of tool 1", "then", DETAILS)


@pytest.fixture
def plc(state_folder):
    with serve_modbus_tcp(SoftMotionSimulator(seed=3)) as host:
        with robolink.connect(host.url) as controller:
            assert controller.outcomes.open_markers() == ()
        yield host.url


@pytest.fixture
def run_beside(capsys):
    def ran(*arguments):
        code = main.run([*arguments])
        return code, capsys.readouterr().err

    return ran


class LateClock(BootClock):
    """The time of 20 s ago."""

    def now_ns(self):
        return super().now_ns() - 20 * NS_PER_S


def session(plc, *, clock=None, **holder):
    """Return the log of another process that is calibrating."""
    own = this_process()
    other = replace(LeaseHolder("ann", "pc-7", pid=own.pid, boot=own.boot), **holder)
    log = open_journal().log(
        plc, holder=other, clock=clock, signature=Signature(operator="Ann Lee")
    )
    log.begin(MARKER)
    return log


def test_it_is_told_who_is_at_work_and_never_to_recover(plc, run_beside):
    session(plc)
    for command in (["status"], ["tool", "list"], ["where"]):
        code, err = run_beside("-c", plc, *command)
        assert code == 0
        assert "Ann Lee (ann, process" in err
        assert "on pc-7) has had this controller locked since" in err
        assert "calibration of tool 1" in err
        assert "It is still working" in err
        assert "recover' puts" not in err


@pytest.mark.parametrize(
    "command",
    [["recover"], ["recover", "--yes"], ["recover", "--forget", "--yes"], ["jog", "x+1", "--yes"]],
)
def test_what_would_interfere_is_refused_with_the_holder_s_name(plc, run_beside, command):
    session(plc)
    code, err = run_beside("-c", plc, *command)
    assert code == 5
    assert "Ann Lee" in err
    assert len(open_journal().open_markers()) == 1


def test_who_only_holds_the_lease_is_told_too(plc, run_beside):
    own = this_process()
    holder = LeaseHolder(os_user="ann", host="pc-7", pid=own.pid, boot=own.boot)
    with open_journal().log(plc, holder=holder).hold("a question to the person"):
        assert "a question to the person" in run_beside("-c", plc, "status")[1]


def test_a_holder_on_another_computer_is_named_without_waiting(plc, run_beside):
    session(plc, boot="another start of another system")
    code, err = run_beside("-c", plc, "status")
    assert code == 0
    assert "has had this controller locked" in err
    assert "Watch it for a while" in err


@pytest.mark.parametrize("gone", ["silent", "ended"])
def test_what_a_dead_session_left_is_to_be_recovered(plc, run_beside, gone):
    if gone == "silent":
        session(plc, clock=LateClock())
    else:
        own = this_process()
        namespace = own.process_start.partition(" ")[0]
        session(plc, pid=own.pid, process_start=f"{namespace} 1")
    code, err = run_beside("-c", plc, "status")
    assert code == 0
    assert '" recover' in err
    assert "at work" not in err


def test_doctor_does_not_send_anybody_to_recover_beside_it(plc, run_beside, capsys):
    session(plc)
    main.run(["doctor"])
    shown = capsys.readouterr()
    assert "has had this controller locked" in shown.out + shown.err
    assert "recover" not in shown.out + shown.err


# A second person watches while another robolink of this computer has the EPSON controller locked.


@pytest.fixture
def held(state_folder):
    """A served controller that another session has locked; yields it with its URL."""
    simulator = EpsonSimulator(seed=4)
    with serve_tcp(simulator) as host, robolink.connect(host.url) as controller:

        def seen():
            found = controller.ledger.seen
            return None if found is None else (found[0], controller.clock.now_ns() - found[1])

        with StopListener(controller, host.url, who="ann ('robolink change')", seen=seen):
            yield simulator, controller, host.url


def test_status_shows_who_has_it_and_the_last_state_with_its_age(held, capsys):
    simulator, controller, url = held
    simulator.panel.press_estop()
    controller.status()
    before = controller.exchanges
    assert main.run(["-c", url, "status"]) == 0
    out = capsys.readouterr().out
    assert out.startswith("ann ('robolink change') has locked this controller.")
    assert " s ago: emergency stop" in out
    assert main.run(["-c", url, "--json", "status"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["schema"] == "robolink/status-beside/1"
    assert said["held_by"].startswith("ann")
    assert said["state"] == "emergency stop"
    assert said["emergency_stop"] is True
    assert 0.0 <= said["age_s"] < 60.0
    assert controller.exchanges == before, "nothing was read for it"


def test_a_holder_that_lets_nobody_look_keeps_nobody_from_asking_the_controller(
    state_folder, capsys
):
    with serve_tcp(EpsonSimulator(seed=4)) as host:
        with robolink.connect(host.url) as controller:
            pass
        with StopListener(controller, host.url, who="ann"):
            assert main.run(["-c", host.url, "--json", "status"]) == 0
    assert json.loads(capsys.readouterr().out)["schema"] == "robolink/status/1"


# Reading during production, and the companion program that makes tools visible then.


def test_monitor_only_commands_disturb_no_production(run, simulator, golden):
    simulator.panel.set_monitoring_only(True)
    simulator.panel.start_production()
    simulator.log.clear()
    clock = clock_of(simulator.url.rpartition("/")[2])
    for command in (
        ["status"],
        ["tool", "list", "--published"],
        ["compare", golden, "--published"],
    ):
        code, out, _ = run(*command, "--json")
        assert (code, json.loads(out)["schema"].startswith("robolink/")) == (0, True)
        clock.advance(1000)
        with simulator.acting():
            assert simulator.condition.task is Task.RUNNING
        assert not simulator.condition.error
    asked = {text.partition(",")[0] for _, way, text in simulator.log if way == ">"}
    looking = {"$Login", "$GetStatus", "$GetAlm", "$GetContSettings", "$GetVariable"}
    assert asked == looking | {"$GetContNo", "$GetRobotSerial"}


def test_status_shows_the_published_tool_where_execute_is_not_available(run, simulator):
    simulator.panel.start_production()
    code, out, _ = run("status")
    assert code == 0
    assert "selected tool, as published: 1" in out
    document = json.loads(run("status", "--json")[1])
    assert (document["selected_tool"], document["published_selected_tool"]) == (None, 1)


@pytest.mark.skipif(not hasattr(os, "openpty"), reason="needs a pseudo terminal")
def test_a_status_over_rs232_shows_the_flags_and_names_what_was_not_read(capsys):
    simulator = EpsonSimulator(seed=3)
    simulator.panel.start_production()
    with serve_serial(simulator, clock=ScaledClock(40.0)) as host:
        assert main.run(["-c", host.url, "status"]) == 0
        shown = capsys.readouterr().out
        assert main.run(["-c", host.url, "status", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert "flags: remote, running" in shown
    assert "not read: alarms, preferences, selected tool, motors, power" in shown
    assert (document["state"], document["running"]) == ("running", True)
    for name in ("alarms", "preferences", "selected_tool", "published_selected_tool", "power"):
        assert document[name] is None


def test_published_tools_are_listed_and_compared_while_production_runs(run, simulator, golden):
    simulator.panel.start_production()
    assert run("compare", golden, "--published")[0] == 0
    simulator.machine.tools.set(2, ToolOffset(5.5))
    code, out, _ = run("tool", "list", "--published", "--json")
    document = json.loads(out)
    assert (code, document["source"], document["tools"]["2"]["x_mm"]) == (0, "published", 5.5)
    assert run("compare", golden, "--published")[0] == 1


@pytest.mark.parametrize("command", [["tool", "list"], ["compare", "golden.json"]])
def test_a_running_program_is_told_with_the_way_out(run, simulator, golden, command):
    simulator.panel.start_production()
    code, _, err = run(*command)
    assert code == 5
    assert "--published" in err


def test_a_project_without_the_companion_is_told_how_to_get_it(run, golden):
    code, _, err = run("compare", golden, "--published")
    assert code == 2
    assert "spel export" in err


def test_the_companion_is_exported_and_changed_files_are_kept(run, tmp_path):
    code, out, _ = run("spel", "export", "project")
    program = tmp_path / "project" / "robolink_tools.prg"
    assert code == 0
    assert str(program.relative_to(tmp_path)) in out
    assert b"Function RobolinkPublish\r\n" in program.read_bytes()
    assert "0BSD" in (tmp_path / "project" / "LICENSE").read_text()
    assert run("spel", "export", "project")[0] == 0
    program.write_text("' changed")
    code, _, err = run("spel", "export", "project")
    assert (code, "differs" in err, program.read_text()) == (2, True, "' changed")
    assert run("spel", "export", "project", "--force")[0] == 0
    assert "RobolinkPublish" in program.read_text()


def test_the_export_as_a_document(run, tmp_path):
    code, out, _ = run("spel", "export", "project", "--json")
    document = json.loads(out)
    assert (code, document["schema"]) == (0, "robolink/spel-export/1")
    assert len(document["files"]) == len(spel.companion_texts())


def test_a_folder_that_cannot_be_made_is_told(run, tmp_path):
    (tmp_path / "file").write_text("in the way")
    code, _, err = run("spel", "export", "file/project")
    assert code == 2
    assert "cannot be written" in err
