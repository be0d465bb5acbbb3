"""Control sequences never reach the terminal raw, whatever the source of the text."""

import ast
import json
import re
from pathlib import Path

import pytest
import robolink_cli
from robolink_cli import main
from robolink_cli.console import exit_codes, render
from robolink_cli.console.output import visible

from robolink.errors import RobolinkError
from robolink.protocols.epson_text import VariableType
from tests._rows import in_turn

EVIL = "ok\x1b[2J\x1b]0;x\x07\x9b31m\x08\r\x7fend"
OBEYED = re.compile("[\x00-\x09\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")

OF_CONTROLLERS = {
    ("status",): "code 4002 ok\\x1b[2J",
    ("verify-controller",): "",
    ("where",): "",
    ("io", "get", "0"): "",
    ("tool", "list"): "",
    ("var", "get", "g_text$"): "ok\\x1b[2J",
    ("execute-raw", "Print g_text$"): "",
    ("motors", "on"): "",
}


@pytest.fixture
def evil(simulator):
    """A controller whose every text contains control sequences."""
    card = simulator.card
    card.name = card.kind = card.project = card.robot_name = EVIL.replace("\r", "")
    simulator.machine.serial = card.name
    card.messages[4002] = card.name
    simulator.variables.declare("g_text$", VariableType.STRING, value=card.name)
    return simulator


@pytest.mark.parametrize(("command", "fault"), in_turn(OF_CONTROLLERS, [True, False], " ".join))
def test_no_word_of_a_controller_is_obeyed(run, evil, command, fault):
    if fault:
        evil.panel.raise_error(4002)
    _, out, err = run(*command)
    assert not OBEYED.search(out + err)
    if fault or command[0] == "var":
        assert OF_CONTROLLERS[command] in out + err
    code, out, _ = run(*command, "--json")
    assert not OBEYED.search(out)
    assert json.loads(out) is not None or code


def test_an_answer_that_makes_no_sense_is_shown_as_escapes(run, simulator):

    def push(_, request):
        if "Login" not in request:  # later text may hold the password, and is not shown
            simulator.push(b"#GetIO,\x1b[2J\x9b\r\n")

    simulator.on_request = push
    code, out, err = run("status")
    assert code != 0
    assert not OBEYED.search(out + err)
    assert "\\x1b[2J" in err


def test_what_was_typed_is_not_obeyed_either(run):
    for arguments in (["--\x1b[2Jevil"], ["tool", "get", "\x1b[2J"], ["\x1b[2J"]):
        code, out, err = run(*arguments)
        assert code == 2
        assert not OBEYED.search(out + err)


@pytest.mark.parametrize("option", ["--operator", "--nozzle", "--lot"])
@pytest.mark.parametrize("text", ["A\x1b[2J", "A\nB", "A\x9b", "A\u202eB", "A" * 201])
def test_what_goes_on_record_is_one_line_without_control_characters(run, simulator, option, text):
    value = simulator.machine.tools.get(1)
    code, _, err = run("tool", "set", "1", "--x", "12.5", option, text)
    assert code == 2
    assert option in err
    assert not OBEYED.search(err)
    assert simulator.machine.tools.get(1) == value


def test_a_name_from_the_environment_is_judged_alike(run, monkeypatch):
    monkeypatch.setenv("ROBOLINK_OPERATOR", "A\x1b[2J")
    code, _, err = run("status")
    assert code == 2
    assert "control characters" in err


@pytest.mark.parametrize("text", ["\x1b", "\x07", "\t", "\r", "\x7f", "\x9b", "\u202e", "\u2067"])
def test_every_door_escapes(command, capsys, text):
    def act(context):
        render.say(f"say {text}")
        render.note(f"note {text}")
        render.table(f"title {text}", [f"column {text}"], [[f"cell {text}"]])

    command(act)
    assert main.run(["status"]) == 0
    exit_codes.report(RobolinkError(f"what {text}", remedy=f"remedy {text}"), as_json=False)
    shown = capsys.readouterr()
    escaped = text.encode("unicode_escape").decode()
    for door in ("say", "title", "column", "cell"):
        assert f"{door} {escaped}" in shown.out
    for door in ("note", "what", "remedy"):
        assert f"{door} {escaped}" in shown.err
    assert not OBEYED.search(shown.out + shown.err)


def test_lines_and_the_worlds_characters_are_left_alone():
    text = "三号线 é 90° ✓ 🤖\n第二行"
    assert visible(text) == text
    assert visible("one\r\ntwo\r\n") == "one\ntwo\n"


PRINTS = re.compile(
    r"\b(s?echo|print|print_exception|print_exc)\b|\bstd(out|err)[\s)]*\.\s*write(lines)?\b"
)


def test_there_is_one_door_to_the_console():
    """Output that bypasses the function is not cleaned."""
    allowed = {
        "output.py": {"echo"},
        "render.py": {"print"},  # of rich, with cells that went through output.py
        "completion.py": {"echo"},  # a script for the shell, of our own words
        "unfit_packages.py": {"write"},  # used where click cannot be imported; JSON, or visible()
        "stop.py": {"write"},  # JSON for the panel, whose process it is; nobody reads it
    }
    folder = Path(robolink_cli.__file__).parent
    examples = folder / "examples"  # in the wheel: programs to be copied, which print as they like
    for module in sorted(set(folder.rglob("*.py")) - set(examples.rglob("*.py"))):
        source = module.read_text(encoding="utf-8")
        names = set()
        # Parsing a module without any of these names would show nothing.
        for node in ast.walk(ast.parse(source)) if PRINTS.search(source) else ():
            if isinstance(node, ast.Call):
                function = node.func
                name = getattr(function, "attr", getattr(function, "id", ""))
                if name in ("echo", "secho", "print", "print_exception", "print_exc") or (
                    name in ("write", "writelines")
                    and isinstance(function, ast.Attribute)
                    and ast.unparse(function.value) in ("sys.stdout", "sys.stderr")
                ):
                    names.add(name)
        assert names <= allowed.get(module.name, set()), module
