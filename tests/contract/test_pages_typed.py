"""Parts of pages, run as printed from top to bottom, against one simulated cell.

Every ``$ robolink`` line of a part runs in this process; a line ``(exit code N)`` below it gives
its exit code. The part's own TOML cells are written to ``robolink.toml``, with the simulator in
place of every address.
"""

import re
import shlex
from pathlib import Path

import pytest
from robolink_cli import main
from robolink_simulators.cell.tip_switches import LightBeam
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.in_process.epson import register, unregister

pytestmark = pytest.mark.simulator_only

ROOT = Path(__file__).parents[2]
TOML = re.compile(r"^```toml\n(.*?)^```", re.M | re.S)
CONSOLE = re.compile(r"^```console\n(.*?)^```", re.M | re.S)
CELL = '[cells.line3]\nurl = "epson+tcp://192.168.0.1:5000"\n'
CI = "testing#In a CI machine without hardware"
LINE_COMPUTER = "commands#A line computer runs the change"
RECIPES = {CI: "needle-beams"}
"""The recipe that a part calls needle.toml without giving its source."""

NEW_NOZZLE = {LINE_COMPUTER, CI}
"""The parts that begin with another nozzle mounted and the motors on."""

TYPED: dict[str, tuple[pytest.MarkDecorator, ...]] = {
    "tutorial#Ten minutes with a simulated robot": (),
    "stopping#After a crash, a cut link or an emergency stop": (),
    "cell-files#People and roles": (),
    "accuracy#A check every night": (),
    "controllers#Connecting an EPSON controller": (),
    "controllers#First time on hardware": (pytest.mark.soak,),
    LINE_COMPUTER: (pytest.mark.soak,),
    CI: (),
}
"""The parts of pages that run here, each by page and heading, with their marks."""


@pytest.fixture
def cell(tmp_path, monkeypatch):
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
    monkeypatch.chdir(tmp_path)
    simulator = EpsonSimulator(seed=3, serial="SIM00001", state_path=tmp_path / "flash.json")
    for number, heading_deg in ((3, 2.0), (4, 91.0)):
        beam = LightBeam((175.0, 488.0, -106.0), heading_deg, radius_mm=0.1)
        simulator.world.connect(number, beam, latency_s=0.002, noise_mm=0.003)
    register("pages", simulator)
    yield simulator
    unregister("pages")


def typed(page):
    """Return the commands of a page, with the exit code that it gives for each."""
    lines = [line for block in CONSOLE.findall(page) for line in block.splitlines()]
    ends = [re.fullmatch(r"\(exit code (\d+)\)", line) for line in (*lines[1:], "")]
    return [
        (line.removeprefix("$ robolink "), int(end[1]) if end else 0)
        for line, end in zip(lines, ends, strict=True)
        if line.startswith("$ robolink ")
    ]


def part(name):
    """Return the text of a page below one of its headings, up to the next one."""
    file, _, heading = name.partition("#")
    page = (ROOT / "docs" / f"{file}.md").read_text(encoding="utf-8")
    _, found, below = page.partition(f"\n## {heading}\n")
    assert found, name
    return re.split(r"^## ", below, maxsplit=1, flags=re.M)[0]


def without_typed_parts(page):
    """Return the text of a page without the parts that run here."""
    text = page.read_text(encoding="utf-8")
    for name in TYPED:
        if name.partition("#")[0] == page.stem:
            text = text.replace(part(name), "")
    return text


@pytest.mark.parametrize("name", [pytest.param(name, marks=marks) for name, marks in TYPED.items()])
def test_a_part_of_a_page_can_be_typed_from_top_to_bottom(cell, name, tmp_path, capsys):
    page = part(name)
    cells = "".join(block for block in TOML.findall(page) if "[cells." in block) or CELL
    cells = re.sub(r'^url = ".*"', f'url = "{cell.url}"', cells, flags=re.M)
    if "confirmed_by" not in cells:
        confirmed = "remote_timeout_s = 60\nremote_timeout_confirmed_by = 'me'\n"
        cells = cells.replace("url = ", f"{confirmed}url = ")
    (tmp_path / "robolink.toml").write_text(cells, encoding="utf-8")
    if recipe := RECIPES.get(name):
        example = ROOT / "examples" / "recipes" / f"{recipe}.toml"
        (tmp_path / "needle.toml").write_bytes(example.read_bytes())
    if name in NEW_NOZZLE:
        cell.machine.motors_on = True
        cell.world.change_nozzle(1)
    commands = typed(page)
    assert len(commands) >= 2
    for line, expected in commands:
        words = shlex.split(line.partition("  #")[0].replace("ASSIST", cell.url))
        code = main.run(words)
        shown = capsys.readouterr()
        assert code == expected, f"robolink {line}\n{shown.out}{shown.err}"
