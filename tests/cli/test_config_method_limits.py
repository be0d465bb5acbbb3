"""``cell validate`` says what methods will refuse of a cell's limits, in their words."""

import json

import pytest
from robolink_cli import main

from robolink.config import load_cells
from tests.contract._method_cell import method_cell

pytestmark = pytest.mark.simulator_only

ABOVE = "The robot would stop {clearance} mm from contact, and a new tip may be {limit} mm longer."


@pytest.fixture
def cell(tmp_path, monkeypatch):
    with method_cell("epson", tmp_path, monkeypatch) as cell:
        yield cell


def say(folder, *lines):
    path = folder / "robolink.toml"
    path.write_text(path.read_text().replace("[cells.a]", "\n".join(["[cells.a]", *lines]), 1))
    return path


def check(capsys, *file):
    code = main.run(["config", "check", *map(str, file), "--json"])
    (entry,) = json.loads(capsys.readouterr().out)["files"]
    return code, {problem["where"]: problem["what"] for problem in entry["problems"]}


@pytest.mark.parametrize(
    ("lines", "where", "why"),
    [
        (("clearance_mm = 1",), "clearance_mm", ABOVE.format(clearance=1, limit=2)),
        (("max_change_mm = 3",), "max_change_mm", ABOVE.format(clearance=2, limit=3)),
        (
            ("clearance_mm = 2.5", "max_change_mm = 4"),
            "clearance_mm",
            ABOVE.format(clearance=2.5, limit=4),
        ),
        (("lift_mm = 5", "clearance_mm = 4"), "clearance_mm", "must be more than 1.8 below "),
    ],
)
def test_what_every_calibration_would_refuse_is_said(cell, tmp_path, capsys, lines, where, why):
    path = say(tmp_path, *lines)
    code, problems = check(capsys)
    assert (code, list(problems)) == (2, [f"cells.a.{where}"])
    assert problems[f"cells.a.{where}"].startswith(why)
    assert "two-pose" in problems[f"cells.a.{where}"]
    assert check(capsys, path) == (code, problems)
    refused = cell.calibrate("two-pose")
    assert refused.code == 2
    assert why in refused.document["error"]["what"]
    # Everything else works with such a file: a look and a stop most of all.
    assert cell.run("status", "--json").code == 0


@pytest.mark.parametrize(
    "lines",
    [(), ("max_change_mm = 1.5",), ("clearance_mm = 3", "max_change_mm = 3"), ("lift_mm = 20",)],
)
def test_what_methods_take_is_right(cell, tmp_path, capsys, lines):
    say(tmp_path, *lines)
    assert check(capsys) == (0, {})
    assert load_cells()["a"]


def test_what_only_one_method_refuses_names_that_one(cell, tmp_path, capsys):
    say(tmp_path, "lift_mm = 6")
    code, problems = check(capsys)
    assert (code, list(problems)) == (2, ["cells.a.clearance_mm"])
    assert "These methods refuse it: one-touch." in problems["cells.a.clearance_mm"]


def test_files_are_looked_at_together_and_the_one_that_says_it_is_named(
    tmp_path, monkeypatch, capsys
):
    for name in ("ROBOLINK_CONFIG", "ROBOLINK_CELL"):
        monkeypatch.delenv(name, raising=False)
    near, far = tmp_path / "near", tmp_path / "far"
    near.mkdir()
    (far / "robolink").mkdir(parents=True)
    url = 'url = "epson+tcp://127.0.0.1:5000"'
    (far / "robolink" / "robolink.toml").write_text(f"[cells.a]\n{url}\nclearance_mm = 3\n")
    (near / "robolink.toml").write_text("[cells.a]\nmax_change_mm = 2.5\n")
    monkeypatch.chdir(near)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(far))
    assert main.run(["config", "check", "--json"]) == 0
    assert len(json.loads(capsys.readouterr().out)["files"]) == 2
    (near / "robolink.toml").write_text("[cells.a]\nmax_change_mm = 3.5\n")
    assert main.run(["config", "check", "--json"]) == 2
    wrong = [bool(entry["problems"]) for entry in json.loads(capsys.readouterr().out)["files"]]
    # The clearance of the far file is what is too small.
    assert wrong == [False, True]
