"""Bad input and a cut cable: a clear sentence, the right exit code, nothing sent unasked."""

import json
import re
import socket
from typing import Any

import pytest
from robolink_cli import main

from tests.faults._nozzle_cell import MOVE, OLD_TIP, NozzleCell, served_cell
from tests.faults._requests import changes

# Bad input: each gives a clear sentence, the right exit code, and sends nothing unasked.

CANARY = "k4nar1envogel"
WRONG = "n1chtd4spasswort"

SET = ["tool", "set", "1", "--x", "13", "--yes"]
CLEAR = ["tool", "clear", "1", "--yes"]
SELECT = ["tool", "select", "0", "--yes"]
JOG = ["jog", "z+1", "--yes"]
CALIBRATE = ["calibrate", "two-pose", "--tool", "1", "--yes"]
MOTORS = ["motors", "on", "--yes"]


@pytest.fixture(autouse=True)
def _own_state_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))


@pytest.fixture
def cell(tmp_path, monkeypatch):
    with served_cell(tmp_path / "cell", monkeypatch) as cell:
        yield cell


def check_refused(shown, code, words):
    """Check for a sentence on what happened, and one on what to do."""
    assert shown.code == code, shown.err
    assert shown.out == ""
    what, *stands, remedy = shown.err.partition("robolink: ")[2].splitlines()
    assert words in f"{what} {' '.join(stands)} {remedy}"
    assert what.endswith((".", ")"))
    assert len(stands) < 2
    assert len(remedy.strip()) > 10


def check_refused_as_document(shown, exit_code, /, **expected):
    assert shown.code == exit_code
    document = json.loads(shown.out)
    assert document["schema"] == "robolink/error/1"
    assert document["exit_code"] == exit_code
    assert document["error"]["what"]
    assert document["error"]["remedy"]
    assert {key: document["error"][key] for key in expected} == expected


def check_nothing_was_changed(cell):
    assert changes(cell.requests) == []
    assert cell.tool_1 == OLD_TIP
    assert cell.simulator.machine.arm.moves_started == 0
    cell.check_settings_are_those_of_before()
    assert cell.open_markers() == ()


STATES = {
    "controller in Teach": ("teach", "teach", "TEACH"),
    "e-stop pressed": ("press_estop", "emergency_stop", "emergency stop is pressed"),
    "guard open": ("open_guard", "guard_open", "guard is open"),
    "running": ("start_production", "running", "program is running"),
    "serious error": ("raise_serious_error", "serious_fault", "off and on"),
    "monitoring only": ("", "not_remote", "Set Control Device = Remote Ethernet"),
}


@pytest.mark.parametrize(
    ("state", "command"),
    [
        pytest.param(
            state,
            command,
            id=f"{state}-{' '.join(command)}",
            marks=pytest.mark.soak if row != column else (),
        )
        for row, state in enumerate(STATES)
        for column, command in enumerate([SET, CLEAR, SELECT, JOG, CALIBRATE, MOTORS])
    ],
)
def test_a_state_that_forbids_it_is_named_and_nothing_is_sent(cell, state, command):
    act, reason, words = STATES[state]
    panel = cell.simulator.panel
    if act:
        getattr(panel, act)()
    else:
        panel.set_monitoring_only(True)
    check_refused(cell.run(*command), 5, words)
    document = cell.run(*command, "--json")
    check_refused_as_document(document, 5, kind="NotReadyError", reason=reason)
    check_nothing_was_changed(cell)


def test_a_status_is_shown_in_teach_mode_with_the_guard_open_and_while_production_runs(cell):
    panel = cell.simulator.panel
    for act, undo, flag in (
        ("teach", "auto", "teach"),
        ("open_guard", "close_guard", "guard_open"),
        ("start_production", "stop_production", "running"),
    ):
        getattr(panel, act)()
        shown = cell.run("status", "--json")
        assert shown.code == 0, shown.err
        assert json.loads(shown.out)[flag] is True
        getattr(panel, undo)()
    assert changes(cell.requests) == []


def test_motors_that_are_off_are_named_and_nothing_moves(cell):
    assert cell.run("motors", "off").code == 0
    shown = cell.run(*JOG, "--json")
    check_refused_as_document(shown, 5, reason="motors_off")
    assert cell.simulator.machine.arm.moves_started == 0
    assert cell.selected_tool == 1
    assert cell.open_markers() == ()


NUMBERS = {
    "tool 16": (["tool", "set", "16", "--x", "1"], "There is no tool 16"),
    "tool 16, read": (["tool", "get", "16"], "There is no tool 16"),
    "tool 16, cleared": (["tool", "clear", "16"], "There is no tool 16"),
    "tool 16, selected": (["tool", "select", "16"], "There is no tool 16"),
    "tool 16, calibrated": (["calibrate", "two-pose", "--tool", "16"], "There is no tool 16"),
    "tool 0": (["tool", "set", "0", "--x", "1"], "never written"),
    "tool 0, cleared": (["tool", "clear", "0"], "never written"),
    "tool 0, calibrated": (["calibrate", "two-pose", "--tool", "0"], "never written"),
    "NaN": (["tool", "set", "1", "--x", "nan"], "x_mm is not a number"),
    "infinity": (["tool", "set", "1", "--u", "inf"], "u_deg is not a number"),
    "no component": (["tool", "set", "1"], "Give at least one of --x --y --z --u --v --w."),
    "no jog step": (["jog", "--yes", "x0.1"], "is not a step"),
    "jog with a decimal comma": (
        ["jog", "--yes", "x+0,1"],
        "Write the decimal point as '.': x+0.1. Nothing moved.",
    ),
    "jog NaN": (["jog", "--yes", "x+nan"], "is not a step"),
    "too large a step": (["jog", "--yes", "x+50"], "more than one step may be"),
    "clearance above the lift": (
        ["calibrate", "two-pose", "--tool", "1", "--clearance", "20"],
        "must be more than 1.8 below --lift",
    ),
}


@pytest.mark.parametrize("name", NUMBERS)
def test_a_wrong_number_is_a_mistake_in_the_command_and_nothing_is_sent(cell, name):
    arguments, words = NUMBERS[name]
    check_refused(cell.run(*arguments), 2, words)
    check_refused_as_document(cell.run(*arguments, "--json"), 2)
    check_nothing_was_changed(cell)


@pytest.mark.parametrize("value", ["abc", "1,5", ""])
def test_text_where_a_number_belongs_is_a_usage_error(cell, value):
    shown = cell.run("tool", "set", "1", "--x", value)
    assert shown.code == 2
    assert f"--x: '{value}' is not a decimal number" in shown.err
    check_refused_as_document(cell.run("tool", "set", "1", "--x", value, "--json"), 2)
    assert cell.requests == []


def test_an_undefined_tool_is_not_selected(cell):
    check_refused(cell.run("tool", "select", "7"), 5, "Tool 7 is not defined")
    check_nothing_was_changed(cell)


def test_a_wrong_password_is_tried_once_and_shown_nowhere(tmp_path, monkeypatch):
    secret = tmp_path / "secret"
    secret.write_text(f"{WRONG}\n")
    secret.chmod(0o600)
    with served_cell(tmp_path / "cell", monkeypatch, password=CANARY) as cell:
        shown = cell.run("status", "--password-file", str(secret))
        check_refused(shown, 5, "refused the login (code 13)")
        assert [request for request in cell.requests if "ogin" in request] == ["$Login,***"]
        monkeypatch.setenv("ROBOLINK_PASSWORD", WRONG)
        as_document = cell.run(*SET, "--json")
        check_refused_as_document(as_document, 5, kind="LoginRefusedError", code=13)
        monkeypatch.setenv("ROBOLINK_PASSWORD", CANARY)
        right = cell.run(*SET, "--json")
        assert right.code == 0
        seen = [repr((shown, as_document, right)), repr(list(cell.simulator.log))]
    files = [path for path in (tmp_path / "cell").rglob("*") if path.is_file()]
    seen += [path.read_bytes().decode("latin-1") for path in files]
    assert files
    assert not [text for text in seen if CANARY in text or WRONG in text]


def test_a_password_file_that_others_may_read_is_refused_before_anything_is_sent(cell, tmp_path):
    secret = tmp_path / "secret"
    secret.write_text(WRONG)
    secret.chmod(0o644)
    shown = cell.run("status", "--password-file", str(secret))
    check_refused(shown, 2, f"chmod 600 {secret}")
    assert WRONG not in shown.err
    assert cell.requests == []


def run(capsys, *arguments):
    code = main.run(arguments)
    out, err = capsys.readouterr()
    return code, out, err


def closed_port():
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return listener.getsockname()[1]


def test_a_closed_port_is_not_reached(capsys):
    url = f"epson+tcp://127.0.0.1:{closed_port()}"
    code, out, err = run(capsys, "-c", url, "status")
    assert (code, out) == (3, "")
    assert url.partition("//")[2].partition(":")[0] in err
    code, out, _ = run(capsys, "-c", url, "--json", *SET)
    document = json.loads(out)
    assert (code, document["exit_code"], document["error"]["kind"]) == (3, 3, "ConnectError")
    assert document["error"]["remedy"]


URLS = {
    "no controller named": ([], "No controller is named"),
    "a password in the URL": (["-c", f"epson+tcp://user:{CANARY}@127.0.0.1:5000"], "password"),
    "a password as an option": (["-c", f"epson+tcp://127.0.0.1?password={CANARY}"], "password"),
    "a password and a bad port": (["-c", f"epson+tcp://u:{CANARY}@127.0.0.1:x"], "cannot be read"),
    "an unknown medium": (["-c", "epson+smoke://hill"], "epson+smoke"),
    "an unknown kind": (["-c", "toaster+tcp://127.0.0.1:5000"], "toaster"),
    "a web address": (["-c", "http://127.0.0.1:5000"], "http"),
}


@pytest.mark.parametrize("name", URLS)
def test_a_wrong_url_is_a_mistake_in_the_command_and_a_password_is_not_echoed(capsys, name):
    arguments, words = URLS[name]
    code, out, err = run(capsys, *arguments, "status")
    assert (code, out) == (2, "")
    what, remedy = err.removeprefix("robolink: ").splitlines()[:2]
    assert words in what
    assert remedy.strip()
    as_json = run(capsys, *arguments, "status", "--json")
    document = json.loads(as_json[1])
    assert document["exit_code"] == as_json[0] == 2
    assert CANARY not in out + err + as_json[1] + as_json[2]


@pytest.mark.parametrize("command", [CALIBRATE, JOG], ids=" ".join)
def test_nobody_to_ask_and_no_yes_means_no(cell, command):
    without_yes = [word for word in command if word != "--yes"]
    check_refused(cell.run(*without_yes), 9, "--yes")
    check_refused_as_document(cell.run(*without_yes, "--json"), 9, kind="DeclinedError")
    check_nothing_was_changed(cell)


def test_an_implausible_change_is_refused_and_not_written(cell):
    refused = cell.run(*cell.calibration, "--max-change", "0.01")
    assert refused.code == 7
    assert "0.010 mm is allowed" in refused.err
    assert "--max-change" in refused.err
    as_json = cell.run(*cell.calibration, "--max-change", "0.01", "--json")
    check_refused_as_document(as_json, 7, kind="CalibrationError", code="implausible_change")
    assert cell.simulator.machine.flash_writes == 0
    cell.check_nothing_else_was_written()
    cell.check_settings_are_those_of_before()
    assert cell.open_markers() == ()


def test_a_drift_beyond_the_tolerance_puts_the_old_value_back(cell):
    refused = cell.run(*cell.calibration, "--tolerance", "0.0001", "--json")
    check_refused_as_document(refused, 8, kind="VerifyError")
    assert "The old value of tool 1 is back." in json.loads(refused.out)["error"]["what"]
    assert cell.tool_1 == OLD_TIP
    assert cell.simulator.machine.flash_writes == 2
    cell.check_nothing_else_was_written()
    cell.check_settings_are_those_of_before()
    assert cell.open_markers() == ()


def test_a_status_is_shown_with_the_e_stop_pressed(cell):
    cell.simulator.panel.press_estop()
    shown = cell.run("status")
    assert shown.code == 0
    assert "emergency stop" in shown.out


# Cable gone during a move: a clear sentence, exit code 6, and the move is never sent again.

TARGET = re.compile(r"XY\(([-\d.]+),")


def cut_during_move(cell: NozzleCell, nth: int) -> list[bool]:
    """Cut the cable as the ``nth`` move begins; of every second one at the first request after it.

    The returned list tells afterwards whether the arm was moving then. A longer move is asked about
    while it lasts; a shorter one has ended, and was answered, by that time.
    """
    moving: list[bool] = []
    arm = cell.simulator.machine.arm
    started = arm.on_started

    def cut(begins: bool = False) -> None:
        cell.simulator.on_request, arm.on_started = None, started
        cell.simulator.panel.cut_link()
        moving.append(begins or arm.next_change() is not None)

    def begun(*motion: Any) -> None:
        started(*motion)
        if cell.moves_requested == nth and nth % 2:
            cut(begins=True)

    arm.on_started = begun

    def hold(_number: int, request: str) -> None:
        if cell.moves_requested == nth and not MOVE.match(request):
            cut()

    cell.simulator.on_request = hold
    return moving


def check(cell: NozzleCell, nth: int) -> bool:
    moving = cut_during_move(cell, nth)
    cut = cell.run(*cell.calibration)
    if moving == [True]:
        check_the_outcome_is_called_unknown(cut)
    else:
        written = cell.simulator.machine.flash_writes > 0
        check_the_link_is_called_broken(cut, code=6 if written else 3)
    cell.wait_at_rest()
    assert cell.moves_requested == nth
    assert cell.simulator.machine.arm.moves_started <= nth
    cell.check_nothing_else_was_written()
    if cell.simulator.machine.flash_writes:
        assert "Tool 1 may hold the new value, which was never tested" in cut.err
    check_the_next_command_says_what_is_left(cell, unknown=moving == [True])
    check_motion_is_blocked_until_recovered(cell)
    assert cell.moves_requested == nth + 1
    return moving == [True]


def check_the_outcome_is_called_unknown(cut):
    assert cut.code == 6, cut.err
    assert "may or may not have run" in cut.err
    assert "Not sent again;" in cut.err
    assert "'robolink recover'" in cut.err


def check_the_link_is_called_broken(cut, *, code):
    assert cut.code == code, cut.err
    assert "robolink could not select the previous tool 1 again" in cut.err
    assert "'robolink recover' selects it" in cut.err


def check_the_next_command_says_what_is_left(cell, *, unknown):
    shown = cell.run("status")
    assert shown.code == 0, shown.err
    (last,) = [text for text in cell.requests if MOVE.match(text)][-1:]
    (x_mm,) = TARGET.findall(last)
    begun = f"without a clear answer: a movement to X {x_mm}"
    assert (begun in shown.err) is unknown
    if cell.selected_tool == 0:
        assert "Tool 0 is selected now; it was tool 1 before" in shown.err


def check_motion_is_blocked_until_recovered(cell):
    for command in (("jog", "z+0.5", "--yes"), tuple(cell.calibration)):
        refused = cell.run(*command)
        assert refused.code == 6
        assert "'robolink recover'" in refused.err
    recovered = cell.run("recover", "--yes")
    assert recovered.code == 0, recovered.err
    cell.check_settings_are_those_of_before()
    assert cell.open_markers() == ()
    cell.check_nothing_else_was_written()
    moved = cell.run("jog", "z+0.5", "--yes")
    assert moved.code == 0, moved.err


@pytest.mark.timeout(600)
@pytest.mark.parametrize(
    "every", [pytest.param(5, id="sample"), pytest.param(1, id="each", marks=pytest.mark.soak)]
)
def test_cable_gone_during_a_move_is_unknown_is_not_resent_and_is_settled_by_recover(
    tmp_path, monkeypatch, every
):
    with served_cell(tmp_path / "whole", monkeypatch) as cell:
        assert cell.run(*cell.calibration).code == 0
        moves = cell.moves_requested
    cut_while_moving = 0
    for nth in range(1, moves + 1, every):
        with served_cell(tmp_path / str(nth), monkeypatch, speed=50.0) as cell:
            try:
                cut_while_moving += check(cell, nth)
            except AssertionError as error:
                error.add_note(f"cut during move {nth} of {moves}")
                raise
    assert cut_while_moving >= 5 / every
