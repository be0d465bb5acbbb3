"""One page of all tools of a cell: value, last change, age, what is due."""

import json
from pathlib import Path

import robolink
from robolink.model import EntryKind, NewEntry

RECIPE = Path(__file__).parents[2] / "examples" / "recipes" / "needle-one-touch.toml"


def test_each_tool_is_shown_with_its_last_change_and_its_age(run, simulator):
    code, out, _ = run("cell", "tools")
    assert code == 0
    assert "never from here" in out
    assert run("tool", "set", "2", "--x", "5", "--y", "6", "--z", "-70", "--yes")[0] == 0
    code, out, _ = run("cell", "tools")
    assert "today" in out
    code, out, _ = run("--json", "cell", "tools")
    assert code == 0
    said = json.loads(out)
    assert said["schema"] == "robolink/cell-tools/1"
    assert said["selected_tool"] == 1
    assert said["tools"]["1"]["changed_at"] is None
    two = said["tools"]["2"]
    assert two["offset"]["z_mm"] == -70.0
    assert 0.0 <= two["age_days"] < 0.5
    assert (two["as_recorded"], two["due"]) == (True, [])

    simulator.machine.tools.set(2, simulator.machine.tools.get(1))
    two = json.loads(run("--json", "cell", "tools")[1])["tools"]["2"]
    assert two["as_recorded"] is False
    assert "it was left with" in two["due"][0]


def test_what_is_due_comes_from_the_recipes_and_the_record(run, simulator, tmp_path):
    (tmp_path / "a.toml").write_text(RECIPE.read_text(encoding="utf-8"), encoding="utf-8")
    touch = {
        "station": "PIN-07", "x_mm": 1.0, "y_mm": 2.0, "z_mm": 3.0, "u_deg": 0.0,
        "sigma_mm": 0.01, "changes": 16, "full_sigma_mm": 0.01, "touch_sigma_mm": 0.02,
    }  # fmt: skip
    value = list(simulator.machine.tools.get(1).components())
    with robolink.connect(simulator.url) as controller:
        details = {"touch": touch, "value": value}
        controller.outcomes.append(NewEntry(EntryKind.DONE, change="c", tool=1, details=details))
    one = json.loads(run("--json", "cell", "tools")[1])["tools"]["1"]
    assert one["changes_left"] == 4
    assert one["due"] == ["Tool 1: A full calibration is due after 4 more changes."]
    assert "Tool 1: A full calibration is due after 4 more changes." in run("cell", "tools")[1]
