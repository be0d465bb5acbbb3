"""Every command with every refusal: an exit code, what happened, what to do.

The leaves of the command table are looked up, so a new command without a row fails here. The
controller is in process; ``test_commands_bad_input`` has the cases that need a socket, and supplies
the checks and the states.
"""

import json
from types import SimpleNamespace

import click
import pytest
from robolink_cli import main
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.in_process.epson import register, unregister

from robolink.model import Secret
from tests.cli.test_commands_bad_input import (
    STATES,
    check_refused,
    check_refused_as_document,
    closed_port,
)
from tests.faults._requests import changes

POSES = ["--pose", "287.7,103.9,0", "--pose", "312.3,96.1,180"]

NEEDS_A_CONTROLLER = {
    "status": [],
    "robot where": [],
    "stop": [],
    "robot reset": ["--yes"],
    "robot motors": ["on", "--yes"],
    "recover": ["--yes"],
    "tool list": [],
    "cell tools": [],
    "tool get": ["1"],
    "tool set": ["1", "--x", "13", "--yes"],
    "tool clear": ["1", "--then-select", "0", "--yes"],
    "tool select": ["0", "--yes"],
    "tool backup": ["new.json"],
    "tool restore": ["golden.json", "--yes"],
    "tool compare": ["golden.json"],
    "robot io get": ["1"],
    "robot io set": ["1", "on", "--yes"],
    "robot variable get": ["g_Long"],
    "robot variable set": ["g_Long", "1", "--type", "Long", "--yes"],
    "expert verify-controller": [],
    "expert check-contract": [],
    "robot jog": ["z+1", "--yes"],
    "calibrate two-pose": ["--tool", "1", *POSES, "--yes"],
    "calibrate n-angle": ["--tool", "1", *POSES, "--pose", "296.1,87.7,90", "--yes"],
    "tool impact": ["--tool", "1", "--x", "13", "--points", "1-5"],
}
"""Each command with arguments that succeed on a controller that is ready."""

ANY_STATE = {
    "status",
    "recover",
    "expert verify-controller",
    "robot io get",
    "robot variable get",
}
"""Commands that only read, by queries that are legal at any time."""

STOPPABLE = set(STATES) - {"controller in Teach", "monitoring only"}
"""States in which a stop works: a stop must not wait for a good state."""

BAD = {
    "tool get": (["16"], "There is no tool 16"),
    "tool set": (["0", "--x", "1"], "never written"),
    "tool clear": (["16"], "There is no tool 16"),
    "tool select": (["-1"], "reads -1 as an option"),
    "robot motors": (["up"], "cannot be 'up'"),
    "tool backup": (["golden.json"], "exists already"),
    "tool restore": (["golden.json", "--tool", "16"], "16"),
    "tool compare": (["missing.json"], "cannot be read"),
    "robot io get": ([], "Only one place can be read"),
    "robot io set": (["70000", "on"], "70000"),
    "robot variable get": (["g_Long", "--index", "0"], "need --type"),
    "robot variable set": (["g_Long", "x", "--type", "Long"], "x"),
    "expert verify-controller": (["--timeout", "0"], "0"),
    "expert check-contract": (["now"], "Two controllers are named"),
    "robot jog": (["--yes", "x0.1"], "is not a step"),
    "calibrate two-pose": (["--tool", "1", "--taught-tool", "0"], "--taught-tool"),
    "calibrate n-angle": (["--tool", "1", "--angles", "0,90"], "must hold at least 3"),
    "calibrate one-touch": (["--tool", "1"], "--station is missing"),
    "calibrate beams": (["--tool", "1", "--station", "B"], "no station 'B'"),
    "calibrate z-touch": (
        ["--tool", "1", "--station", "P", "--speeds", "x"],
        "must be numbers with commas",
    ),
    "calibrate camera": (["--tool", "1", "--station", "C"], "no station 'C'"),
    "calibrate camera-affine": (
        ["--tool", "1", "--station", "C", "--at", "1,2"],
        "'1,2' is not a place",
    ),
    "calibrate board": (["--tool", "1", "--station", "C"], "say where the fiducials are"),
    "calibrate runout-table": (
        ["--tool", "1", "--station", "C", "--angles", "0,45,90,135,180,225,270,280"],
        "must go all round in steps of 60 degrees or less",
    ),
    "calibrate pivot": (["--tool", "1", "--pose", "1,2,3"], "lacks values that are needed"),
    "calibrate plane-touch": (["--tool", "1", "--spread", "30"], "must be more than"),
    "calibrate sphere-touch": (["--tool", "1", "--radius", "30"], "must be more than"),
    "calibrate six-point": (["--tool", "0"], "never written"),
    "calibrate points": (["--tool", "1", "--points", "9-1"], "is not a point"),
    "cell tools": (["1"], "Too many words"),
    "cell new": (["b", "--url", "epson+tcp://x:5000", "--time-out-set", "0"], "time-out-set"),
    "cell accuracy measure": (["bend_deg"], "not measured by this command"),
    "cell station list": (["all"], "Too many words"),
    "cell station show": (["B"], "no station 'B'"),
    "cell station learn": (["B", "--tool", "0"], "--tool cannot be 0"),
    "cell eye look": (["--diameter-px", "1"], "--diameter-px"),
    "cell eye collect": (["pictures", "--truth", "1,2"], "'1,2' is no mark"),
    "tool impact": (["--tool", "1", "--x", "nan", "--points", "1"], "not a number"),
    "status": (["--timeout", "-1"], "-1"),
    "robot where": (["here"], "Too many words"),
    "stop": (["now"], "Too many words"),
    "robot release": (["now"], "Too many words"),
    "robot reset": (["--force"], "No option --"),
    "change": (["missing.toml"], "missing.toml"),
    "robot take-ownership": (["--yes"], "no SoftMotion axis group"),
    "recover": (["all"], "Too many words"),
    "expert execute-raw": (["--yes", "Print\u20ac"], "printable ASCII"),
    "expert plc export": (["golden.json"], "is a file"),
    "expert plc check-map": ([], "is not a PLC with a map"),
    "undo": (["--to", "0"], "--to"),
    "journal report": (["--points", "1-x"], "not a point"),
    "journal list": (["--limit", "0"], "--limit"),
    "journal checks": (["--limit", "0"], "--limit"),
    "journal show": (["abcd"], "'abcd'"),
    "journal diff": (["1"], "is missing. The form is"),
    "journal drift": (["--baseline", "5"], "--baseline"),
    "journal export": (["golden.json"], "exists already"),
    "journal verify": (["all"], "Too many words"),
    "journal move": (["mysql://db.plant/journal"], "'mysql' database"),
    "journal sync": ([], "No PostgreSQL database of a plant is named"),
    "tool list": (["--timeout", "soon"], "soon"),
    "expert demo": (["--speed", "101"], "101"),
    "panel pin": (["--pin-file", "nowhere"], "nowhere"),
    "panel tablets": (["--forget", "7"], "There is no paired tablet 7"),
    "panel token give": (
        [*("mes", "--kind", "dance", "--cell", "*"), *("--until", "2099-01-01")],
        "There is no kind of job 'dance'",
    ),
    "panel token list": (["all"], "Too many words"),
    "panel token revoke": (["mes"], "No line computer 'mes' has a token"),
    "panel cert": (["--show"], "There is no certificate yet"),
    "sim epson": (["--tcp", "nowhere"], "not an address to listen on"),
    "sim softmotion": (["--modbus-tcp", "nowhere"], "not an address to listen on"),
    "sim run": (["missing.toml"], "missing.toml"),
    "sim plc": (["--map", "missing.toml"], "missing.toml"),
    "sim assist": (["http://127.0.0.1:1", "look"], ""),
    "sim ctl": (["look", "--at", "assist+tcp://127.0.0.1:1"], "control URL"),
    "expert solve": (["missing.json"], "missing.json"),
    "expert poses show": (["missing.csv"], "missing.csv"),
    "cell doctor": (["--fix"], "No option --"),
    "cell ports": (["COM1"], "Too many words"),
    "cell scan": (["localhost"], "not a range of addresses"),
    "cell list": (["oven-*"], "There is no cell"),
    "cell check": (["--since", "yesterday"], "cannot be 'yesterday'"),
    "cell people": (["nowhere"], "nowhere"),
    "cell trust": ([], "not reached over OPC UA"),
    "cell certificate": (["again"], "Too many words"),
    "cell fleet plan": (["missing.toml"], "missing.toml"),
    "cell fleet status": (["--why", "a"], "--why needs the plan"),
    "cell fleet run": (["0123456789ab"], "There is no plan yet"),
    "cell fleet next": (["0123456789ab"], "Name the cell"),
    "cell fleet agent": (["a", "b"], "Too many words"),
    "cell fleet report": (["plant", "page.html", "--since", "soon"], "cannot be 'soon'"),
    "cell fleet demo": (["--seed", "x"], "x"),
    "cell fleet halt": (["0123456789ab"], "There is no plan yet"),
    "cell fleet resume": (["0123456789ab"], "--reason is missing"),
    "cell fleet permit give": (["Chen", "--until", "soon"], "cannot be 'soon'"),
    "cell fleet permit list": (["all"], "Too many words"),
    "cell fleet permit revoke": (["0"], "0"),
    "cell files": (["here"], "Too many words"),
    "cell validate": (["--fix"], "No option --"),
    "cell show": (["nowhere"], "nowhere"),
    "expert docs": (["no-such-page"], "No page 'no-such-page'"),
    "expert recipe list": (["all"], "Too many words"),
    "expert recipe new": (["no-such"], "No recipe 'no-such'"),
    "expert recipe check": (["missing.toml"], "missing.toml"),
    "expert completion": (["tcsh"], "cannot be 'tcsh'"),
    "expert serve": (["--spel", "nowhere"], "not an address to listen on"),
    "expert spel export": (["golden.json"], "is a file"),
    "expert spel check": (["nowhere.prg"], "There is no file"),
    "expert spel run": (["nowhere.prg"], "There is no file"),
}
"""Mistakes in the command: exit code 2, and at most reads are sent."""


def leaves(command, path=()):
    """Yield the full names of the commands, including those that the first page leaves out."""
    if not isinstance(command, click.Group):
        yield " ".join(path)
        return
    context = click.Context(command)
    besides = ["expert"] if command is main.cli else []
    for name in command.list_commands(context) + besides:
        inner = command.get_command(context, name)
        assert inner is not None
        yield from leaves(inner, (*path, name))


@pytest.fixture
def golden(request, name):
    """A backup of the controller's initial state, if the command's row needs one."""
    named = (*BAD[name][0], *NEEDS_A_CONTROLLER.get(name, ()))
    if "golden.json" in named or name == "journal show":  # which reads the journal
        assert request.getfixturevalue("run")("backup", "golden.json")[0] == 0


@pytest.fixture
def shown(capsys):
    """Run a command line; return it in the form that the shared checks read."""

    def run(*arguments):
        capsys.readouterr()
        code = main.run(arguments)
        out, err = capsys.readouterr()
        return SimpleNamespace(code=code, out=out, err=err)

    return run


def test_every_command_has_a_row():
    assert set(leaves(main.cli)) == set(BAD)
    assert set(NEEDS_A_CONTROLLER) < set(BAD)


@pytest.mark.parametrize("name", NEEDS_A_CONTROLLER)
def test_on_a_controller_that_is_ready_the_row_is_no_refusal(run, simulator, golden, name):
    simulator.variables.set("g_Long", "1", "Long")
    code, _, err = run(*name.split(), *NEEDS_A_CONTROLLER[name])
    assert code == 0, err


def in_turn(names):
    """Run each command for a person and for a program: half of them here for either."""
    return pytest.mark.parametrize(
        ("name", "as_json"),
        [
            pytest.param(name, form, marks=pytest.mark.soak if (row + column) % 2 else ())
            for row, name in enumerate(names)
            for column, form in enumerate([[], ["--json"]])
        ],
    )


@in_turn(BAD)
def test_bad_values_are_a_mistake_in_the_command(run, simulator, golden, shown, name, as_json):
    arguments, words = BAD[name]
    refused = shown(*as_json, "-c", simulator.url, *name.split(), *arguments)
    if as_json:
        check_refused_as_document(refused, 2)
        error = json.loads(refused.out)["error"]
        assert words in f"{error['what']} {error['remedy']}"
    else:
        check_refused(refused, 2, words)
    assert changes_of(simulator) == []


@in_turn(NEEDS_A_CONTROLLER)
def test_no_controller_named(golden, shown, name, as_json):
    refused = shown(*name.split(), *NEEDS_A_CONTROLLER[name], *as_json)
    if as_json:
        check_refused_as_document(refused, 2, kind="ConfigError")
    else:
        check_refused(refused, 2, "Give -c CELL")


@in_turn(NEEDS_A_CONTROLLER)
def test_a_closed_port(golden, shown, name, as_json):
    given = ["-c", f"epson+tcp://127.0.0.1:{closed_port()}", *name.split()]
    refused = shown(*given, *NEEDS_A_CONTROLLER[name], *as_json)
    if as_json:
        check_refused_as_document(refused, 3, kind="ConnectError")
    else:
        check_refused(refused, 3, "emergency stop" if name == "stop" else "127.0.0.1")


@in_turn(NEEDS_A_CONTROLLER)
def test_a_wrong_password(golden, shown, name, as_json, monkeypatch):
    monkeypatch.setenv("ROBOLINK_PASSWORD", "wrong-one")
    url = register("locked", EpsonSimulator(seed=4, password=Secret("right-one")))
    try:
        refused = shown("-c", url, *name.split(), *NEEDS_A_CONTROLLER[name], *as_json)
    finally:
        unregister("locked")
    if as_json:
        check_refused_as_document(refused, 5, kind="LoginRefusedError", code=13)
    else:
        check_refused(refused, 5, "refused the login (code 13)")
    assert "wrong-one" not in repr(refused)


@pytest.mark.parametrize(
    ("name", "state"),
    [
        pytest.param(name, state, marks=pytest.mark.soak if (row + column) % 3 else ())
        for row, name in enumerate(sorted({*NEEDS_A_CONTROLLER} - ANY_STATE))
        for column, state in enumerate(STATES)
    ],
)
def test_a_state_that_forbids_it(simulator, golden, shown, name, state):
    act, reason, words = STATES[state]
    put_into(simulator, act)
    tools = simulator.machine.tools.defined()
    given = ["-c", simulator.url, *name.split(), *NEEDS_A_CONTROLLER[name]]
    if name == "stop" and state in STOPPABLE:
        assert shown(*given).code == 0
        return
    refused, document = shown(*given), shown(*given, "--json")
    assert refused.code == document.code == 5
    check_refused(refused, 5, "")
    check_refused_as_document(document, 5)
    if name not in ("stop", "robot reset"):
        check_refused(refused, 5, words)
        check_refused_as_document(document, 5, kind="NotReadyError", reason=reason)
        assert changes_of(simulator) == []
    assert simulator.machine.tools.defined() == tools
    assert simulator.machine.flash_writes == 0
    assert simulator.machine.arm.moves_started == 0


@pytest.mark.parametrize(
    ("name", "state"),
    [
        pytest.param(name, state, marks=pytest.mark.soak if (row + column) % 2 else ())
        for row, name in enumerate(sorted(ANY_STATE))
        for column, state in enumerate(STATES)
    ],
)
def test_a_state_that_does_not_matter(simulator, golden, shown, name, state):
    simulator.variables.set("g_Long", "1", "Long")
    put_into(simulator, STATES[state][0])
    done = shown("-c", simulator.url, *name.split(), *NEEDS_A_CONTROLLER[name])
    assert done.code == 0, done.err


def changes_of(simulator):
    return changes([text for _, direction, text in simulator.log if direction == ">"])


def put_into(simulator, act):
    if act:
        getattr(simulator.panel, act)()
    else:
        simulator.panel.set_monitoring_only(True)
