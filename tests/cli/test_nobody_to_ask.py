"""Without a terminal no command waits for an answer: it ends with 9 and a reason, or acts.

docs/commands.md, "Without a terminal", has a row for every command that may ask; a new command that
takes ``--yes`` fails here until it has one.
"""

import io
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import click
import pytest
from robolink_cli import main
from robolink_simulators.plc import PlcSimulator, serve_plc
from robolink_simulators.testkit.operator import written_recipe

from robolink.register_maps import load_map
from robolink.timing import NS_PER_S
from tests.cli.test_refusals_of_every_command import leaves
from tests.contract._method_cell import method_cell

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "commands.md"
NOBODY = "nobody to ask"

CAMERA = """
[cells.a.stations.CAM]
kind = "camera"
sensor = "{url}"
x_mm = {plate.x_mm}
y_mm = {plate.y_mm}
z_mm = {plate.z_mm}
mm_per_px = [[0.02, 0.0], [0.0, -0.02]]
origin_mm = [1.0, 2.0]
"""
POSES = ("--pose", "287.7,103.9,0", "--pose", "312.3,96.1,180")
TOOL = ("--tool", "1")
SEEN = (*TOOL, "--station", "CAM")

STUDY = {
    "method": "gauge_rr",
    "input": {
        "values": [
            [
                [0.01 * nozzle + 0.002 * person + 0.001 * again for again in range(3)]
                for person in range(3)
            ]
            for nozzle in range(5)
        ]
    },
}

ASKS: dict[str, list[tuple[str, ...]]] = {
    "change": [(), ("recipe.toml",)],
    "undo": [()],
    "calibrate two-pose": [TOOL, (*TOOL, *POSES)],
    "calibrate n-angle": [TOOL],
    "calibrate one-touch": [(*TOOL, "--station", "PIN-07")],
    "calibrate beams": [(*TOOL, "--station", "BEAMS-02")],
    "calibrate z-touch": [(*TOOL, "--station", "PLATE")],
    "calibrate camera": [SEEN],
    "calibrate camera-affine": [SEEN],
    "calibrate board": [(*SEEN, "--spacing", "40")],
    "calibrate runout-table": [SEEN],
    "calibrate points": [(*TOOL, "--points", "1,2")],
    "cell station learn": [("PIN-07", *TOOL), ("BEAMS-02", *TOOL), ("PLATE", *TOOL)],
    "robot jog": [(), ("z+1",)],
    "expert check-contract": [("--write", "--tool", "5"), ("--move",)],
    "expert execute-raw": [("Print 1",)],
}
"""Commands that end with 9 on a four-axis robot, with their arguments."""

SIX_AXES: dict[str, list[tuple[str, ...]]] = {
    "calibrate pivot": [TOOL],
    "calibrate six-point": [TOOL],
    "calibrate plane-touch": [TOOL],
    "calibrate sphere-touch": [TOOL],
}
"""The same on a six-axis robot."""

OF_A_PLC = {"robot take-ownership", "expert plc check-map"}
"""Commands that ask only on PLCs: each has its own test below."""

CONSENT: dict[str, tuple[str, ...]] = {
    "tool set": ("1", "--x", "13"),
    "tool clear": ("2",),
    "tool select": ("1",),
    "tool restore": ("kept.json",),
    "robot motors": ("on",),
    "robot reset": (),
    "robot release": (),
    "robot io set": ("1", "on"),
    "robot variable set": ("g_Long", "1", "--type", "Long"),
    "recover": (),
    "cell accuracy measure": ("touch_mm", "--study", "study.json"),
}
"""Commands that are the consent by themselves, or decide by reading; they act at once."""

HELP = {(): "Every day", ("calibrate",): "two-pose", ("robot", "jog", "--keys"): "steps"}
"""Commands that end with 2 and show what can be typed instead."""


class NobodyThere(io.StringIO):
    """A stdin that is not a terminal and must not be read."""

    def read(self, *_):
        raise AssertionError("an answer was waited for")

    readline = read


@pytest.fixture(scope="module")
def cell(request, tmp_path_factory):
    """A cell for typed commands; the parameter chooses its kind."""
    kind, folder = request.param[0], tmp_path_factory.mktemp("cell")
    with pytest.MonkeyPatch.context() as patch, method_cell(kind, folder, patch) as made:
        patch.chdir(folder)
        if kind == "epson":
            made.mount()
            with (folder / "robolink.toml").open("a") as file:
                file.write(CAMERA.format(url=made.cell.url, plate=made.cell.plate))
            for number, pose in enumerate(POSES[1::2], 1):
                taught = f"P{number} = XY({pose.rsplit(',', 1)[0]}, -50, {pose.rsplit(',', 1)[1]})"
                assert made.run("expert", "execute-raw", taught, "--yes").code == 0
            assert made.run("tool", "backup", "kept.json").code == 0
            assert made.run("tool", "set", "3", "--x", "1").code == 0
            assert written_recipe(folder).name == "recipe.toml"
            (folder / "study.json").write_text(json.dumps(STUDY))
            x, y, z = made.world.pin_mm
            about = ((-12.3, 3.9, 0), (12.3, -3.9, 180), (-3.9, -12.3, 90))
            touches = (f"{x + dx},{y + dy},{z + 20},{u}" for dx, dy, u in about)
            typed = [word for touch in touches for word in ("--pose", touch)]
            words = (*TOOL, *typed, "--taught-tool", "0", "--station", "PIN-07", "--yes")
            assert made.run("calibrate", "n-angle", *words).code == 0
        yield made


def rows(table, *kind):
    """Return a parameter for each row."""
    return [
        pytest.param(kind, name, words, id=" ".join((name, *words)))
        for name, many in table.items()
        for words in many
    ]


def done_by(cell):
    counted = cell.cell.simulator.counters()
    return counted["moves_started"], counted["tool_writes"]


@pytest.mark.parametrize(
    ("cell", "name", "words"),
    [*rows(ASKS, "epson"), *rows(SIX_AXES, "C8-C901S")],
    indirect=["cell"],
    scope="module",  # of the cell; else each test has one made
)
def test_what_asks_ends_with_9_and_says_that_nobody_is_there(cell, monkeypatch, name, words):
    monkeypatch.setattr(sys, "stdin", NobodyThere())
    before, at_ns = done_by(cell), cell.clock.now_ns()
    ended = cell.run(*name.split(), *words)
    assert ended.code == 9, ended.err
    (said,) = re.findall(r"^robolink: (.*)", ended.err, re.MULTILINE)
    assert NOBODY in said
    assert "--yes" in ended.err
    assert done_by(cell) == before
    assert cell.clock.now_ns() - at_ns < NS_PER_S
    if name in ("change", "undo", "calibrate two-pose", "robot jog"):
        document = cell.run(*name.split(), *words, "--json").document
        assert document["error"]["kind"] == "DeclinedError"


@pytest.mark.parametrize(
    ("cell", "name", "words"),
    rows({name: [words] for name, words in CONSENT.items()}, "epson"),
    indirect=["cell"],
    scope="module",  # of the cell; else each test has one made
)
def test_where_the_command_is_the_consent_it_is_done_at_once(cell, monkeypatch, name, words):
    monkeypatch.setattr(sys, "stdin", NobodyThere())
    cell.cell.simulator.variables.set("g_Long", "1", "Long")
    at_ns = cell.clock.now_ns()
    ended = cell.run(*name.split(), *words)
    assert ended.code == 0, ended.err
    assert cell.clock.now_ns() - at_ns < NS_PER_S


@pytest.mark.parametrize("words", HELP)
def test_what_is_not_said_is_asked_for_in_the_end(monkeypatch, capsys, words):
    monkeypatch.setattr(sys, "stdin", NobodyThere())
    assert main.run([*words]) == 2
    assert HELP[words] in capsys.readouterr().err


@pytest.mark.parametrize("cell", [("plc",)], indirect=True)
def test_a_mailbox_that_somebody_holds_is_not_taken(cell, monkeypatch):
    monkeypatch.setattr(sys, "stdin", NobodyThere())
    with cell.cell.connected() as other:
        other.take()
        ended = cell.run("robot", "take-ownership")
    assert (ended.code, NOBODY in ended.err) == (9, True), ended.err


def test_a_map_that_nobody_has_compared_stays_unconfirmed(state_folder, monkeypatch, capsys):
    monkeypatch.setattr(sys, "stdin", NobodyThere())
    path = ROOT / "examples" / "plc-maps" / "level-handshake.toml"
    with serve_plc(PlcSimulator(load_map(path)), path) as host:
        assert main.run(["-c", host.url, "expert", "plc", "check-map"]) == 9
    assert NOBODY in capsys.readouterr().err


def test_a_process_whose_input_is_no_terminal_ends_by_itself(state_folder):
    paths = os.pathsep.join(path for path in sys.path if path)
    ended = subprocess.run(
        [sys.executable, "-m", "robolink_cli", "change"],
        check=False,
        env={**os.environ, "PYTHONPATH": paths},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert (ended.returncode, ended.stdout) == (9, "")
    assert NOBODY in ended.stderr


def asking():
    """Yield the commands that take --yes, or measure."""
    for name in leaves(main.cli):
        command: click.Command | None = main.cli
        for word in name.split():
            assert isinstance(command, click.Group)
            command = command.get_command(click.Context(command), word)
        assert command is not None
        if name.startswith("calibrate ") or any(one.name == "yes" for one in command.params):
            yield name


def test_every_command_that_asks_has_a_row_here_and_on_the_page():
    with_9, with_0 = [*ASKS, *SIX_AXES, *OF_A_PLC], [*CONSENT]
    assert len({*with_9, *with_0}) == len(with_9) + len(with_0)
    assert {*asking()} <= {*with_9, *with_0}
    page = PAGE.read_text(encoding="utf-8")
    told = page[page.index("### Without a terminal") :].split("\n### ")[0]
    for code, names in ((9, with_9), (0, with_0)):
        (row,) = re.findall(rf"^\| {code} \| (.*) \|$", told, re.MULTILINE)
        for name in names:
            assert f"`{name}`" in row or f"`{name.split()[0]} ...`" in row, (name, code)
