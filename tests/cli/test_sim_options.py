"""Options of simulators: common names, faults, kinematics, and replayed recordings."""

import json
import os
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import click
import pytest
from robolink_cli import main
from robolink_cli.commands.simulate.sim import sim, softmotion
from robolink_cli.commands.simulate.simulated_kind import plan_faults
from robolink_cli.console.help_pages import SectionedCommand
from robolink_cli.console.render import switch_json_on
from robolink_simulators.epson import EpsonSimulator
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.faults import LinkKind
from robolink_simulators.hosting.in_process.epson import register, unregister

from robolink.model import Secret
from robolink.timing import NS_PER_S
from tests.cli.test_command_names import run_on_terminal

# One set of option names for every simulator, grouped on its help page; old names still work.

SERVED = ("epson", "softmotion", "plc")
OF_EVERY_COMMAND = {"--json", "--lang", "--log-file", "--log-level"}
COMMON = {
    *("--tcp", "--serial", "--allow-remote", "--seed", "--speed", "--faults"),
    *("--control", "--with-parent", "--idle-exit"),
}


def options(name):
    command = sim.commands[name]
    assert isinstance(command, SectionedCommand)
    return command, {
        one.opts[0]: one
        for one in command.params
        if isinstance(one, click.Option) and not one.hidden
    }


@pytest.mark.parametrize("name", SERVED)
def test_each_simulator_has_the_common_names_and_every_option_a_heading(name):
    command, shown = options(name)
    assert set(shown) >= COMMON
    grouped = frozenset().union(*(names for _, names in command.sections))
    assert set(shown) - grouped == OF_EVERY_COMMAND


def test_an_option_of_one_name_takes_the_same_everywhere():
    kinds: dict[str, set[str]] = {}
    for name in SERVED:
        for option, parameter in options(name)[1].items():
            kinds.setdefault(option, set()).add(parameter.type.name)
    # A project of SPEL+ is files, an exported PLC program a folder.
    assert {one for one, found in kinds.items() if len(found) > 1} == {"--program"}


def test_the_help_page_says_each_option_once_and_no_name_of_before(capsys):
    assert main.run(["sim", "softmotion", "--help"]) == 0
    page = capsys.readouterr().out
    assert "--modbus" not in page
    for option in options("softmotion")[1]:
        assert page.count(f"\n  {option} ") == 1, option
    headings = ["Where it is served:", "What is simulated:", "Options:"]
    assert [page.index(one) for one in headings] == sorted(page.index(one) for one in headings)


@pytest.mark.parametrize("name", ["softmotion", "plc"])
def test_a_name_of_before_says_its_new_one_on_a_terminal_and_does_the_same(name, tmp_path):
    more = ["--map", str(tmp_path / "none.toml")] if name == "plc" else []
    words = ["sim", name, *more, "--modbus-tcp", "nowhere"]
    code, shown = run_on_terminal(*words)
    assert (code, shown[0]) == (2, "--modbus-tcp is now called --tcp.")
    code, shown = run_on_terminal(*words, "--tcp", "127.0.0.1:0")
    assert code == 2
    assert "--modbus-tcp is now called --tcp: give one of them." in " ".join(shown)


@pytest.mark.parametrize("option", ["--modbus-tcp", "--tcp"])
def test_an_address_of_either_name_is_refused_by_todays(option, capsys):
    assert main.run(["--json", "sim", "softmotion", option, "nowhere"]) == 2
    error = json.loads(capsys.readouterr().out)["error"]
    assert "'nowhere' is not an address" in error["what"]
    assert error["remedy"] == "Write for example --tcp 127.0.0.1:5000."


# sim --faults: planned faults apply to any client, and each is reported.

LOST = """
schema = "robolink/faults/1"
link = "{link}"
[[fault]]
action = "{action}"
match = "{match}"
"""


@pytest.fixture
def plan(tmp_path):
    def write(link, action, match=""):
        path = tmp_path / "plan.toml"
        path.write_text(LOST.format(link=link, action=action, match=match), encoding="utf-8")
        return str(path)

    return write


@contextmanager
def in_this_process(path, capsys):
    """Yield the URL of a simulator with the plan, and a function that returns its next report."""
    simulator = EpsonSimulator()
    simulator.advance(NS_PER_S)
    with click.Context(click.Command("sim")) as context:
        switch_json_on(context)
        plan_faults(simulator, Path(path), {LinkKind.EPSON_TCP})
    # Its client waits in simulated time: no answer is late, however busy the computer is.
    yield register("planned-faults", simulator), lambda: capsys.readouterr().out


@contextmanager
def by_command(path, _capsys):
    """The same with ``robolink sim`` in a separate process."""
    arguments = ["sim", "epson", "--tcp", "127.0.0.1:0", "--faults", path]
    paths = os.pathsep.join(path for path in sys.path if path)
    with subprocess.Popen(
        [sys.executable, "-m", "robolink_cli", "--json", *arguments],
        env={**os.environ, "PYTHONPATH": paths},
        stdout=subprocess.PIPE,
        text=True,
    ) as served:
        assert served.stdout is not None
        try:
            yield json.loads(served.stdout.readline())["url"], served.stdout.readline
        finally:
            served.terminate()
        assert served.wait(timeout=20) == 0


@pytest.mark.parametrize(
    "served", [in_this_process, pytest.param(by_command, marks=pytest.mark.soak)]
)
def test_a_lost_answer_is_told_by_the_simulator_and_ends_the_client_in_doubt(
    state_folder, capsys, plan, served
):
    path = plan("epson+tcp", "drop_reply", "TLSet 2, XY")
    with served(path, capsys) as (url, told):
        tool = ["tool", "set", "2", "--x", "10", "--y", "0", "--z", "-50"]
        assert main.run(["-c", url, "--timeout", "10", *tool]) == 6
        document = json.loads(next(line for line in told().splitlines() if line[0] == "{"))
    assert document["schema"] == "robolink/fault/1"
    assert document["fault"] == {"action": "drop_reply", "match": "TLSet 2, XY"}
    assert document["request"].startswith('$Execute,"TLSet 2, XY(10')
    assert document["simulated_s"] > 0


def test_a_person_is_told_in_words(capsys, plan):
    simulator = EpsonSimulator()
    plan_faults(simulator, Path(plan("epson+tcp", "drop_reply")), {LinkKind.EPSON_TCP})
    simulator.connect(0).receive(b"$Login,secret\r\n", 0)
    assert capsys.readouterr().out == "FAULT drop_reply: $Login,***\n"


@pytest.mark.parametrize(
    ("command", "link", "action", "told"),
    [
        (["epson"], "softmotion+can", "echo", "echo cannot happen on epson+tcp"),
        (["epson"], "softmotion+can", "drop_reply", 'Write link = "epson+tcp" in the plan'),
        (["softmotion"], "softmotion+can", "echo", "echo cannot happen on softmotion+modbus-tcp"),
        (["softmotion"], "epson+tcp", "lose_login", "lose_login cannot happen on softmotion"),
        (
            ["epson"],
            "epson+tcp",
            "drop_replay",
            "line 5, fault 1, action: is not known",
        ),
    ],
)
def test_what_cannot_happen_is_refused_before_anything_is_served(
    state_folder, capsys, plan, command, link, action, told
):
    assert main.run(["sim", *command, "--faults", plan(link, action)]) == 2
    assert told in capsys.readouterr().err


# sim softmotion --kinematics: TAB completion, near misses, and a class in the present folder.

EXAMPLES = Path(__file__).parents[2] / "examples" / "kinematics"


def refusal(capsys, *more):
    code = main.run(["sim", "softmotion", "--modbus-tcp", "127.0.0.1:0", *more])
    return code, capsys.readouterr().err


@pytest.mark.parametrize(
    ("start", "offered"),
    [
        ("Kin_P", ["Kin_Polar", "Kin_Polar_Z", "Kin_Pos_RRR"]),
        ("kin_gantry3+kin_c", ["Kin_Gantry3+Kin_CAxis", "Kin_Gantry3+Kin_CAxis_Tool"]),
    ],
)
def test_tab_completes_the_names_of_kinematics(start, offered):
    option = next(it for it in softmotion.params if it.name == "kinematics")
    context = click.Context(softmotion)
    assert [it.value for it in option.shell_complete(context, start)] == offered


def test_a_name_that_is_nearly_right_is_told_the_right_one(capsys):
    code, told = refusal(capsys, "--kinematics", "Kin_Scara3Z")
    assert code == 2
    assert "Did you mean Kin_Scara3_Z" in told


def test_what_cannot_move_by_itself_says_so_by_its_name(capsys):
    code, told = refusal(capsys, "--kinematics", "Kin_Wrist2")
    assert code == 2
    assert "Kin_Wrist2 turns the flange of another kinematics" in told


def test_a_class_is_found_in_the_present_folder(capsys, monkeypatch):
    monkeypatch.setattr(sys, "path", [it for it in sys.path if it])
    monkeypatch.chdir(EXAMPLES)
    named = ("--kinematics", "double_scara:DoubleScara")
    try:
        code, told = refusal(capsys, *named, "--param", "length=1")
        assert code == 2
        assert "has no parameter length" in told
        assert "inner, outer" in told
        code, told = refusal(capsys, *named, "--param", "outer=60")
        assert code == 2
        assert "The outer arms do not meet" in told
    finally:
        sys.modules.pop("double_scara", None)


# verify-controller, --record and sim epson --replay: evidence from a live controller.

PASSWORD = "hush-4711"


@pytest.fixture
def cell(tmp_path, monkeypatch):
    """A cell with a password and unusual options, named by the environment."""
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
    monkeypatch.setenv("ROBOLINK_PASSWORD", PASSWORD)
    options = EpsonOptions(tool_listing="padded", comma_blank="always")
    simulator = EpsonSimulator(seed=4, options=options, password=Secret(PASSWORD))
    monkeypatch.setenv("ROBOLINK_CONTROLLER", register("cli-evidence", simulator))
    yield simulator
    unregister("cli-evidence")


@contextmanager
def command(*arguments):
    """Run ``robolink`` in a separate process; return its first line, parsed, and the process."""
    process = subprocess.Popen(
        [sys.executable, "-m", "robolink_cli", *arguments, "--json"],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        assert process.stdout is not None
        yield json.loads(process.stdout.readline()), process
    finally:
        process.terminate()
        process.communicate(timeout=20)


def test_verify_controller_writes_a_profile_and_a_transcript_without_secrets(
    cell, tmp_path, capsys
):
    profile, transcript = tmp_path / "cell.json", tmp_path / "said.jsonl"
    files = ["--profile", str(profile), "--transcript", str(transcript)]
    assert main.run(["verify-controller", *files, "--redact", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["schema"] == "robolink/verification/1"
    assert document["options"]["tool_listing"] == "padded"
    written = json.loads(profile.read_text())
    assert written["schema"] == "robolink/epson-profile/1"
    assert written["options"] == document["options"]
    assert "second_client" in written["unsettled"]
    said = transcript.read_text()
    for hidden in (PASSWORD, cell.machine.serial):
        assert hidden not in said + profile.read_text()


def test_people_see_what_is_settled_and_why_the_rest_is_not(cell, capsys):
    assert main.run(["verify-controller"]) == 0
    shown = capsys.readouterr().out
    assert "tool_listing=padded" in shown
    assert "it would leave the controller in error" in shown
    assert "Nothing was written, and nothing moved." in shown


def test_a_file_that_cannot_be_written_is_a_mistake_of_the_person(cell, tmp_path, capsys):
    target = str(tmp_path / "no such folder" / "file")
    assert main.run(["verify-controller", "--profile", target]) == 2
    assert main.run(["--record", target, "status"]) == 2
    assert "Nothing was sent" in capsys.readouterr().err


def test_a_recording_holds_the_dialogue_and_not_the_password(cell, tmp_path):
    recording = tmp_path / "day.jsonl"
    assert main.run(["--record", str(recording), "status"]) == 0
    assert main.run(["io", "get", "3", "--record", str(recording)]) == 0
    text = recording.read_text()
    assert PASSWORD not in text
    assert text.count('"schema": "robolink/dialogue/1"') == 2
    assert text.count('"secret": true') == 2
    assert "$GetIO,3" in text


def test_a_recording_is_replayed_as_a_test(
    epson_factory, tmp_path, epson_replay, capsys, monkeypatch
):
    cell, recording = epson_factory(medium="tcp"), tmp_path / "day.jsonl"
    commands = [["status", "--json"], ["tool", "list", "--json"], ["var", "get", "VERSION$"]]

    def shown_of(url, arguments, place):
        # A program that never met the controller asks for its identity: so does each of these
        # commands.
        monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / place / arguments[0]))
        assert main.run(["-c", url, *arguments]) == 0
        return capsys.readouterr().out.replace(url, "URL")

    record = ["--record", str(recording)]
    live = [shown_of(cell.url, [*arguments, *record], "live") for arguments in commands]
    url = epson_replay(recording)
    assert [shown_of(url, arguments, "replay") for arguments in commands] == live


def test_sim_serves_a_recording_and_names_what_differs(cell, tmp_path, capsys):
    recording = tmp_path / "day.jsonl"
    assert main.run(["--record", str(recording), "io", "get", "3"]) == 0
    serve = ["sim", "epson", "--tcp", "127.0.0.1:0", "--replay", str(recording)]
    with command(*serve) as (first, process):
        assert first["replay"] == str(recording)
        assert main.run(["-c", first["url"], "io", "get", "4"]) == 3
        process.terminate()
        _, errors = process.communicate(timeout=20)
    assert "$GetIO,4" in errors
    assert "$GetIO,3" in errors


def test_sim_takes_the_habits_of_a_profile(cell, tmp_path, capsys):
    profile = tmp_path / "cell.json"
    assert main.run(["verify-controller", "--profile", str(profile)]) == 0
    capsys.readouterr()
    habits = ["--profile", str(profile), "--option", "where_width=8"]
    habits += ["--password-env", "ROBOLINK_PASSWORD"]
    with command("sim", "epson", "--tcp", "127.0.0.1:0", *habits) as (first, _):
        assert main.run(["-c", first["url"], "verify-controller", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["options"]
    assert (found["tool_listing"], found["comma_blank"]) == ("padded", "always")
    assert found["where_width"] == 8


@pytest.mark.parametrize(
    ("content", "arguments"),
    [
        ("{}", ["--profile"]),
        ('{"schema": "robolink/epson-profile/1", "options": []}', ["--profile"]),
        ('{"schema": "robolink/epson-profile/1", "options": {"no": 1}}', ["--profile"]),
        ("no recording", ["--replay"]),
        ("", ["--seed", "3", "--replay"]),
        ("", ["--option", "terminator=cr", "--replay"]),
    ],
)
def test_sim_refuses_what_does_not_fit(tmp_path, content, arguments):
    path = tmp_path / "file"
    path.write_text(content)
    assert main.run(["sim", "epson", "--tcp", "127.0.0.1:0", *arguments, str(path)]) == 2
