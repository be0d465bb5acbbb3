"""Every command block of README and the pages is run as printed, or listed with a reason.

``test_pages_typed.py`` runs the parts in its own list. This module runs the other blocks of a page
from top to bottom against one simulated cell, which replaces every address, cell and served
simulator. A command that asks is first run as printed, with nobody to answer: it ends with 9. Then
it is run with ``--yes``, in place of the answer of the person at the cell.
"""

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import pytest
from robolink_cli import main
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.cell.tip_switches import LightBeam
from robolink_simulators.control.assist import serve_assist
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.epson.memory.points import Point
from robolink_simulators.hosting.in_process.epson import register, unregister
from robolink_simulators.hosting.streams.epson import serve_tcp

from tests.contract.test_pages_typed import without_typed_parts
from tests.unit.test_spel_points import block as point
from tests.unit.test_spel_points import pts

pytestmark = pytest.mark.simulator_only

ROOT = Path(__file__).parents[2]
PAGES = [
    *(ROOT / name for name in ("README.md", "README.zh.md")),
    *sorted(ROOT.glob("docs/*.md")),
    *sorted(ROOT.glob("docs/reference/*.md")),
]
BLOCK = re.compile(r"^```console\n(.*?)^```", re.M | re.S)
URL = "epson+sim://pages"


class Elsewhere(NamedTuple):
    """The reason why a block is not run here, the test that runs it, and the text that shows it."""

    why: str
    test: str
    words: tuple[str, ...]


NOT_RUN = {
    "accuracy.md 2": Elsewhere(
        "five calibrations of a gauge tip are needed",
        "tests/cli/test_cell_accuracy.py",
        ('"accuracy", "measure", "touch_mm", "--tool"', '"--true"'),
    ),
    "accuracy.md 3": Elsewhere(
        "a gauge study is needed",
        "tests/cli/test_cell_accuracy.py",
        ('"touch_mm", "--study", "study.json"',),
    ),
    "accuracy.md 4": Elsewhere(
        "five nozzles before a camera are needed, twice",
        "tests/cli/test_cell_accuracy.py",
        ('"tip_image_px", "--station", "CAM-01", "--tool", "1"',),
    ),
    "camera-and-board.md 1": Elsewhere(
        "a camera is needed, three times",
        "tests/contract/test_calibrate_camera.py",
        ('"camera-affine", ', '"calibrate", "camera", ', '"calibrate", "board"'),
    ),
    "camera-and-board.md 2": Elsewhere(
        "a controller's own camera is needed",
        "tests/contract/test_vision_guide.py",
        ('"--sensor", "vision-guide?program=7"',),
    ),
    "control-api.md 1": Elsewhere(
        "curl and a port are needed; the test is that client",
        "tests/contract/test_control_api.py",
        ('"press_estop"', '"add_fault"', '"truth"', '"step"', '"sim", "ctl"'),
    ),
    "fault-plans.md 1": Elsewhere(
        "it serves until Ctrl-C",
        "tests/cli/test_sim_options.py",
        ('"sim", "epson", "--tcp"', '"--faults"', '"TLSet 2, XY"'),
    ),
    "journal.md 1": Elsewhere(
        "a server of PostgreSQL is needed",
        "tests/contract/journal/_postgresql.py",
        ("postgresql+psycopg://",),
    ),
    "journal.md 2": Elsewhere(
        "a server of PostgreSQL is needed",
        "tests/contract/journal/test_journal_plant_commands.py",
        ('run("journal", "sync")', '"ROBOLINK_PLANT"'),
    ),
    "reference/jogging.md 1, 1": Elsewhere(
        "steps are typed one by one",
        "tests/contract/test_typed_answers.py",
        ('start("jog", "-c", url)',),
    ),
    "reference/contract_checks.md 1, 3": Elsewhere(
        "a driver of one's own is needed",
        "tests/cli/test_check_contract.py",
        ('"check-contract", "--yes", "--write", "--tool", "3", "--driver"',),
    ),
    "fleet.md 1, 2": Elsewhere(
        "it serves until Ctrl-C",
        "tests/cli/test_sim_run.py",
        ('"sim", "run"', "test_all_kinds_are_served_by_one_process"),
    ),
    "panel.md 1": Elsewhere(
        "a PIN is typed unseen",
        "tests/panel/access/test_access_commands.py",
        ('"panel", "pin"', '"panel", "pin", "mei"'),
    ),
    "panel.md 2": Elsewhere(
        "it serves until Ctrl-C, under an address of this computer",
        "tests/panel/access/test_access_commands.py",
        ('"panel", "cert"',),
    ),
    "reference/jogging.md 2": Elsewhere(
        "keys are held down on a terminal",
        "tests/contract/test_jog_keys.py",
        ('"jog", "--keys"',),
    ),
}
"""Blocks, and single commands of blocks, that need something not available here."""


def page_name(page):
    return page.relative_to(ROOT).as_posix().removeprefix("docs/")


def text_of(page):
    return page.read_text(encoding="utf-8")


def blocks(page):
    return BLOCK.findall(without_typed_parts(page))


def commands(page):
    """Yield the place of each command, such as ``README.md 1, 4``, its text, and its exit code."""
    for number, shown in enumerate(blocks(page), start=1):
        typed = list(re.finditer(r"^\$ (.*)$", shown, re.M))
        for at, line in enumerate(typed, start=1):
            rest = shown[line.end() :].partition("\n$ ")[0]
            end = re.search(r"^\(exit code (\d+)\)$", rest, re.M)
            place = f"{page_name(page)} {number}, {at}"
            yield place, line[1], int(end[1]) if end else 0


HERE = [page for page in PAGES if blocks(page)]

LONG = dict.fromkeys(
    ("README.zh.md", "poses.md", "recipes.md", "reference/contract_checks.md", "stations.md"),
    pytest.mark.soak,
)
"""Whole needle changes, calibrations and checks; other tests of the default suite cover them."""

CELLS = "".join(
    f"""[cells.{name}]
url = "ADDRESS"
remote_timeout_s = 60
remote_timeout_confirmed_by = "me"
"""
    for name in ("line3", "cell-3", "cell-5")
)
STATION = """[cells.line3.stations.BEAMS-02]
kind = "beams"
z_mm = -106.0
beams = [
    { input = 3, x_mm = 175.0, y_mm = 488.0, direction_deg = 2.0 },
    { input = 4, x_mm = 175.0, y_mm = 488.0, direction_deg = 91.0 },
]
"""
POSES = "x,y,z,u\n287.5,103.25,-60,0\n312.5,96.75,-60,180\n"
TOUCHES = "x,y,z,a,b,c\n287.5,103.25,-60,0,0,180\n312.5,96.75,-60,180,0,180\n"


@pytest.fixture
def cell(tmp_path, monkeypatch):
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
    monkeypatch.chdir(tmp_path)
    simulator = EpsonSimulator(seed=3, serial="SIM00001", state_path=tmp_path / "flash.json")
    for number, heading_deg in ((3, 2.0), (4, 91.0)):
        beam = LightBeam((175.0, 488.0, -106.0), heading_deg, radius_mm=0.1)
        simulator.world.connect(number, beam, latency_s=0.002, noise_mm=0.003)
    for number in range(1, 61):
        place = (250.0, 200.0 + number / 10, -30.0, 0.0, 0.0, 0.0)
        simulator.machine.points.store(number, Point(place))
    simulator.panel.teach()
    for number, u_deg in ((901, 0.0), (902, 180.0), (903, 90.0), (904, -90.0)):
        simulator.world.operator.teach_point(number, u_deg)
    simulator.panel.auto()
    simulator.machine.motors_on = True
    for name in ("needle.toml", "scara-pin.toml"):
        shutil.copy(ROOT / "examples" / "recipes" / "scara-pin.toml", name)
    shutil.copy(ROOT / "examples" / "ci" / "cells.toml", "cells.toml")
    Path("poses.csv").write_text(POSES)
    Path("touches.csv").write_text(TOUCHES)
    Path("robot1.pts").write_text(pts(point(1, 1, X=250, Y=200, Z=-30)))
    return simulator


@contextmanager
def served(cell, page):
    """Yield the addresses of the cell and its person, on fixed ports if a page names them."""
    if "sim assist" in "".join(line for _, line, _ in commands(page)):
        clock = ScaledClock(40.0)
        with serve_tcp(cell, clock=clock) as host, serve_assist(cell, clock=clock) as assist:
            yield host.url, assist.url
        return
    register("pages", cell)
    try:
        yield URL, URL
    finally:
        unregister("pages")


def ended(words, capsys):
    capsys.readouterr()
    code = main.run(words)
    return code, capsys.readouterr()


def agreed(words, person):
    """Return the command with options by which the simulated person confirms and brings the tip."""
    if "--report" in words:  # it is written before the question
        Path(words[words.index("--report") + 1]).unlink()
    live = "change" in words or "two-pose" in words
    by_hand = live and not {"--points", "--pose", "--poses"} & {*words}
    return [*words, "--yes", *(["--assist", person] if by_hand else [])]


def recorded(capsys):
    """Write tool 1 twice; return the id of the first change and the number of its entry."""
    for x in ("12.3", "12.35"):
        assert main.run(["tool", "set", "1", "--x", x, "--y", "-3.7", "--z", "-20"]) == 0
    _, shown = ended(["journal", "list", "--kind", "done", "--json"], capsys)
    first = json.loads(shown.out)["entries"][-1]
    return first["change"], first["number"]


def before(place, cell):
    """Bring the cell into the state that the page assumes by then."""
    if place == "tutorial.md 5, 1":
        cell.panel.teach()
    if place == "stations.md 1, 3":
        gauge = cell.world.tips[15] = cell.world.tips[1]
        cell.machine.tools.set(15, gauge)


@pytest.mark.parametrize(
    "page",
    [pytest.param(page, marks=LONG.get(page_name(page), ()), id=page_name(page)) for page in HERE],
)
def test_the_blocks_of_a_page_can_be_typed(cell, page, capsys, monkeypatch):
    with served(cell, page) as (url, person):
        monkeypatch.setenv("ROBOLINK_CONTROLLER", url)
        Path("robolink.toml").write_text(CELLS.replace("ADDRESS", url) + STATION)
        change, entry = recorded(capsys) if page.name == "records.md" else ("", "")
        for place, line, end in commands(page):
            if not_run(place) or not line.startswith("robolink ") or " sim epson " in line:
                continue  # exported variables are set, served simulators are replaced
            before(place, cell)
            typed = line.partition("  #")[0].replace("9a59", change[:8])
            typed = re.sub(r"(sim assist) (URL|assist\+tcp://\S+)", rf"\1 {person}", typed)
            typed = re.sub(r"epson\+tcp://192\.168\S+|epson\+tcp://127\S+", url, typed)
            typed = re.sub(r"assist\+tcp://TOKEN\S+", person, typed)
            words = shlex.split(typed.replace("undo --to 7", f"undo --to {entry}"))[1:]
            code, shown = ended(words, capsys)
            if code == 9 or "there is nobody to ask" in shown.err:
                code, shown = ended(agreed(words, person), capsys)
            assert code == end, f"{place}: {line}\n{shown.out}{shown.err}"


def not_run(place):
    return NOT_RUN.get(place) or NOT_RUN.get(place.rpartition(",")[0])


@pytest.mark.parametrize("place", NOT_RUN)
def test_a_block_that_is_not_run_is_there_and_says_why(place):
    places = [one for page in HERE for one, *_ in commands(page)]
    assert place in places or place in {one.rpartition(",")[0] for one in places}
    why, test, words = NOT_RUN[place]
    text = (ROOT / test).read_text(encoding="utf-8")
    assert [word for word in words if word not in text] == []
    pytest.skip(f"{place} is not run: {why}; {test} does it")


SCRIPTS = {
    f"{page_name(page)} {number}": script
    for page in PAGES
    for number, script in enumerate(re.findall(r"^```sh\n(.*?)^```", text_of(page), re.M | re.S), 1)
}


@pytest.mark.soak
@pytest.mark.parametrize("place", SCRIPTS)
def test_a_script_runs_in_a_shell(place, tmp_path):
    """Background jobs of the script end with it; it gets a free port."""
    shutil.copy(ROOT / "examples" / "ci" / "cells.toml", tmp_path)
    (tmp_path / "robolink").symlink_to(Path(sys.executable).with_name("robolink"))
    script = SCRIPTS[place].replace("127.0.0.1:5000", "127.0.0.1:0")
    done = subprocess.run(
        ["bash", "-euc", f"{script}\nkill $(jobs -p) || true\nwait || true\n"],
        cwd=tmp_path,
        env=os.environ
        | {"PATH": f"{tmp_path}:{os.environ['PATH']}", "ROBOLINK_STATE_DIR": str(tmp_path / "s")},
        capture_output=True,
        text=True,
        timeout=50,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "epson" in (tmp_path / "sim.json").read_text()
