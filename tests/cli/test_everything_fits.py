"""Tables, screens and pictures fit their space: both languages, 60 to 120 columns.

Everything drawn in columns uses one of three primitives: ``drawn_table``, a wizard's ``Screen``
(always 80 columns; the line dialogue uses the terminal's width), or an SVG drawing.
"""

import io
import re
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from rich.console import Console
from robolink_cli.commands.record.journal_drift import show_drift
from robolink_cli.console import render
from robolink_cli.console.tables import column_widths, drawn_table, is_figures, within
from robolink_cli.options.impact import show_impact
from robolink_cli.views.documents import show_change, show_pose, show_tools
from robolink_cli.views.fit import show_proposal
from robolink_cli.views.journal import show_entry, show_list
from robolink_cli.wizard.screens.sentences import told_before, told_question
from wcwidth import wcswidth, wcwidth

from robolink import Pose, ToolOffset, messages
from robolink.calibration import AccuracyFacts, assessed, carrying, impact_on, solve_pivot
from robolink.calibration_run import Proposal, Seating
from robolink.controllers import SimpleController
from robolink.drift import CellDrift, MeasuredChange, charts_of
from robolink.model import json_value
from robolink.report.pictures.control_chart import chart_drawing
from robolink.report.pictures.plans import draw, pose_drawings
from robolink.report.pictures.residuals import fit_drawings, order_drawings
from robolink.transaction import Wanted, change_tools
from tests._commands import chinese
from tests.cli.wizard.test_screens import SCREENS

WIDTHS = (60, 68, 80, 100, 120)
ROOT = Path(__file__).parents[2]


@pytest.fixture(params=["en", "zh"])
def language(request):
    before = messages._translate
    messages.install(chinese() if request.param == "zh" else None)
    yield request.param
    messages.install(before)


def tilted_result():
    """A tip of a six-axis arm, measured in twelve places, far from 0 along every axis."""
    tip, pin_mm = ToolOffset(-112.512, -103.252, 280.0, -90.0, -15.0, -165.0), (-400, -310, -180)
    angles = [(30.0 * n - 180, 9.0 * (n % 3) - 10, 165.0 + 7 * (n % 4)) for n in range(12)]
    poses = [carrying(Pose(0, 0, 0, *uvw), tip, pin_mm) for uvw in angles]
    moved = [
        Pose(p.x_mm + 0.03 * (n % 2), p.y_mm, p.z_mm - 0.04 * (n % 3), p.u_deg, p.v_deg, p.w_deg)
        for n, p in enumerate(poses)
    ]
    return assessed(solve_pivot(moved, stored=tip), AccuracyFacts())


def tilted_impact():
    points = {n: Pose(-120.5 * n, 410.25, -150.0, 35.0 * n, -10.5, -165.0) for n in range(1, 9)}
    return impact_on(points, old=ToolOffset(-110, 4, 80), new=ToolOffset(-112.3, 6.5, 81.25))


def drift():
    changes = tuple(
        MeasuredChange(
            n,
            f"2026-11-{n:02}T08:00:00Z",
            "c",
            1,
            f"N-{n}",
            "PIN-07",
            {"x": -112.3 + n % 3 / 50},
            None,
            0.05,
            0.021,
            0.064,
        )
        for n in range(1, 29)
    )
    return CellDrift("epson://192.168.100.117:5000", changes, charts_of(changes), ())


def entries():
    with SimpleController() as controller:
        change_tools(controller, [Wanted(3, ToolOffset(-112.5, -103.25, 280, -90), None)])
        return list(controller.outcomes.recorded(tool=3))


SIX = ToolOffset(-1112.512, -1103.252, -1280.001, -179.999, -89.999, -179.999)
PLAIN = json_value(SIX)
PROPOSED = {"tool": 0, "hand": "right", "local": 0, "joints": [-179.999] * 6, **PLAIN}


def show_entries():
    for one in entries():
        show_entry(one)


TABLES = {
    "change": lambda: show_change(1, SIX, SIX, after_name="measured", unmeasured=("u_deg",)),
    "pose": lambda: show_pose(PROPOSED),
    "tools": lambda: show_tools({"1": PLAIN, "15": PLAIN}, 15),
    "proposal": lambda: show_proposal(Proposal(1, SIX, tilted_result(), seating=Seating())),
    "impact": lambda: show_impact(1, tilted_impact()),
    "drift": lambda: show_drift([drift()], all_plots=True),
    "journal": lambda: show_list(entries(), all_controllers=True),
    "entries": show_entries,
}


def drawn(title, heads, rows, width):
    """Return the lines of a table on a terminal with this many columns."""
    out = io.StringIO()
    console = Console(file=out, width=width, highlight=False, color_system=None)
    console.print(drawn_table(title, heads, rows, width), crop=False, markup=False)
    return out.getvalue().rstrip("\n").split("\n")


def check_fits(lines, heads, rows, width):
    assert max(map(wcswidth, lines)) <= width, "\n".join(lines)
    text = "\n".join(lines)
    assert "\u2026" not in text
    shown = set(text.split())
    cells = [*heads, *(cell for row in rows for cell in row)]
    for cell in cells:
        for word in cell.split():
            if word.isascii() and len(word) <= 20:
                assert word in shown, f"{word} of {cell} is cut at {width}:\n{text}"
    # Chinese text wraps anywhere; no character is lost.
    wide = [character for cell in cells for character in cell if wcwidth(character) == 2]
    assert sum(map(text.count, set(wide))) >= len(wide)


def keep(found, told):
    found.append(told)
    return ""


@pytest.mark.parametrize("name", TABLES)
def test_a_table_fits_every_terminal(name, language, monkeypatch):
    found: list[Any] = []
    monkeypatch.setattr(render, "text_table", lambda *told: keep(found, told))
    TABLES[name]()
    assert found
    for title, heads, rows, _ in found:
        for width in {60, *WIDTHS[(language == "zh") :: 2]}:
            check_fits(drawn(title, heads, rows, width), heads, rows, width)


SENTENCES = (
    "-1112.512",
    "A sentence about a tool that is somewhat longer than a column.",
    "这是关于工具的一句比较长的说明。其中没有空格。只有标点。",
    "/home/cell/" + "folder/" * 20 + "end.json",
)


@pytest.mark.parametrize("count", [1, 2, 3, 5, 8, 12])
def test_a_table_of_any_shape_fits(count):
    for shift in range(len(SENTENCES)):
        cells = [SENTENCES[(n + shift) % len(SENTENCES)] for n in range(count)]
        heads = [f"column {n}" for n in range(count)]
        for width in WIDTHS[shift % 2 :: 2]:
            check_fits(drawn("title", heads, [cells, cells], width), heads, [cells], width)


def test_a_table_that_fits_is_as_wide_as_its_cells():
    heads, rows = ["", "X mm"], [["before", "1.000"], ["after", "-12.000"]]
    assert column_widths(heads, rows, 80) == [6, 7]
    assert is_figures(["1.000", "-12.000"])
    assert drawn("t", heads, rows, 80)[2].split() == ["X", "mm"]


def test_a_table_that_is_too_wide_is_turned_before_it_is_taken_apart():
    heads = ["", "X mm", "Y mm", "Z mm", "U deg", "V deg", "W deg"]
    rows = [["before", *["-1112.512"] * 6], ["measured", *["-1103.252"] * 6]]
    turned = drawn("tool 1", heads, rows, 60)
    assert turned[2].split() == ["before", "measured"]
    assert turned[4].split() == ["X", "mm", "-1112.512", "-1103.252"]
    apart = drawn("tool 1", heads, rows * 5, 60)
    assert "  X mm   -1112.512" in apart


def test_every_table_is_drawn_in_one_place():
    imports = re.compile(r"^ +from rich\.table import ", re.MULTILINE)
    using = {
        path.name
        for path in (ROOT / "cli").rglob("*.py")
        if imports.search(path.read_text(encoding="utf-8"))
    }
    assert using == {"tables.py"}


@pytest.mark.parametrize("name", SCREENS)
def test_the_dialogue_of_lines_fits_every_terminal(name, language):
    state = SCREENS[name]().state
    for width in {60, *WIDTHS[(language == "zh") :: 2]}:
        lines = "\n".join([*told_before(state, width), told_question(state)]).split("\n")
        for line in lines:
            # Columns would be torn apart; sentences are wrapped.
            assert wcswidth(line) <= width or "   " not in line.strip(), line
        assert max(wcswidth(row) for row in within("\n".join(lines), width).split("\n")) <= width


SIZES = {"tick": 11.0, "axis": 11.0, "scale": 12.0, "name": 10.5, "largest": 12.5, "l": 22.0}
"""Letter sizes in a drawing, in its own units, by class (``robolink/report/style.css``)."""


def pictures():
    result, impact = tilted_result(), tilted_impact()
    yield from fit_drawings(result)
    yield from pose_drawings(result)
    yield from order_drawings(result, {})
    yield draw(impact)
    yield chart_drawing(drift().charts[0])


def labels(root):
    """Yield text, left, right and bottom of each label of a drawing, shifted like its groups."""

    def walk(one, dx, dy):
        moved = re.match(r"translate\(([-\d.]+) ([-\d.]+)\)$", one.get("transform") or "")
        if moved:
            dx, dy = dx + float(moved[1]), dy + float(moved[2])
        if one.tag.rpartition("}")[2] == "text":
            text = "".join(one.itertext())
            size = max(SIZES[kind] for kind in one.get("class").split())
            # A digit or letter takes six tenths of its height on average; this is more.
            wide = size * sum(1.0 if wcwidth(c) == 2 else 0.6 for c in text)
            back = {"end": wide, "middle": wide / 2}.get(one.get("text-anchor"), 0.0)
            left = float(one.get("x")) + dx - back
            yield text, left, left + wide, float(one.get("y")) + dy
        for inner in one:
            yield from walk(inner, dx, dy)

    yield from walk(root, 0.0, 0.0)


def check_labels(root):
    _, _, width, height = map(float, root.get("viewBox").split())
    for text, left, right, foot in labels(root):
        assert left >= 0, (text, left)
        assert right <= width, (text, right, width)
        assert 8 <= foot <= height, (text, foot, height)


def test_the_labels_of_a_report_s_pictures_stand_on_their_paper(language):
    shown = [*pictures()]
    assert len(shown) >= 5
    for one in shown:
        check_labels(one.svg)
        assert one.caption


def test_what_six_axes_measured_is_said_of_all_three_lengths():
    (said,) = (one.caption for one in fit_drawings(tilted_result()) if "Accurate" in one.caption)
    assert re.search(r"Repeatable: X \+-[\d.]+ mm, Y \+-[\d.]+ mm, Z \+-[\d.]+ mm, each", said)
    assert "Accurate, 95 %, X, Y, Z together: dashed circle" in said


def test_the_touch_turned_by_half_is_one_pin():
    """The needle comes back to the same pin; two pins would teach something else."""
    root = ElementTree.parse(ROOT / "docs/pictures/turn.svg").getroot()
    pins = [one for one in root.iter() if one.get("class") == "p"]
    assert len(pins) == 1
