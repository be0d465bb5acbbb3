"""A needle of another length, measured with standoffs: all upright methods, both kinds, recipes.

As an alternative to the method, the height of the pin may be in the cell file only.
"""

import os
import re
from pathlib import Path

import pytest
from robolink_cli.prompts import operator as _operator

from robolink.calibration import NORMAL_95
from robolink.model import EntryKind
from tests.contract._method_cell import method_cell
from tests.contract.test_touches_not_made import RECIPE

pytestmark = pytest.mark.simulator_only

AT_PIN = ("--station", "PIN-07")
LONG = pytest.mark.soak
METHODS = {"two-pose": AT_PIN, "n-angle": ("--count", "4", *AT_PIN)}
QUESTION = "instead of keeping"


@pytest.fixture
def cell(kind, tmp_path, monkeypatch):
    with method_cell(kind, tmp_path, monkeypatch) as cell:
        yield cell


def recalibrate(cell, folder, method, rule=""):
    path = folder / "recipe.toml"
    kind = method + (f'"\nif_length_changed = "{rule}' if rule else "")
    # These tests leave the turn test out.
    text = RECIPE.format(kind=kind).replace('z = "kept"', 'z = "kept"\nverify = false')
    if method == "n-angle":
        # With six touches, chance alone suggests drift in 1 or 2 of 100 runs.
        text = text.replace("[station]", "count = 4\n[station]")
    path.write_text(text)
    return cell.run("recalibrate", str(path), "--assist", cell.cell.url, "--yes", "--json")


def state_pin(cell, *lines):
    """Write a person's data about the pin into the cell file."""
    path = Path(os.environ["ROBOLINK_CONFIG"])
    place = 'kind = "pin"\n' + "\n".join(lines)
    path.write_text(path.read_text().replace('kind = "pin"', place, 1))
    assert cell.run("config", "check").code == 0


def check_followed(cell, before, told, by_mm):
    """Z follows the needle within the stated interval; the pin's height is not learnt."""
    assert told["changed"]
    assert told["written"] == "difference"
    # 1.7 times the 95 % half width: one in a thousand exceeds it.
    half_mm = 1.7 * NORMAL_95 * told["u_mm"]
    assert cell.stored.z_mm - before.z_mm == pytest.approx(by_mm, abs=half_mm)
    assert half_mm < 0.3
    assert {entry.details["z_mm"] for entry in cell.recorded(EntryKind.STATION)} <= {None}


@pytest.mark.parametrize(
    ("kind", "method", "longer_mm"),
    [
        ("epson", "two-pose", 0.5),
        # With n-angle in test_length_changed.py, on a PLC by a stated height below.
        pytest.param("plc", "two-pose", -0.5, marks=LONG),
        pytest.param("plc", "n-angle", -0.5, marks=LONG),
        pytest.param("epson", "two-pose", -0.5, marks=LONG),
        pytest.param("epson", "n-angle", 0.5, marks=LONG),
        pytest.param("epson", "n-angle", -0.5, marks=LONG),
        pytest.param("plc", "two-pose", 0.5, marks=LONG),
        pytest.param("plc", "n-angle", 0.5, marks=LONG),
    ],
)
def test_a_length_is_told_refused_and_followed(cell, method, longer_mm):
    words = (method, *METHODS[method])
    first = cell.calibrate(*words)
    assert first.code == 0, first.err
    before, entries = cell.stored, len(cell.recorded())
    cell.lengthen(longer_mm, 0.3, -0.2)
    refused = cell.calibrate(*words)
    error = refused.document["error"]
    assert (refused.code, error["code"]) == (7, "length_changed"), refused.err
    assert ("longer" if longer_mm > 0 else "shorter") in error["what"]
    (size,) = re.findall(r"is ([\d.]+) mm (?:longer|shorter)", error["what"])
    assert float(size) == pytest.approx(0.5, abs=0.12)
    assert "--if-length-changed" in error["remedy"]
    assert cell.stored == before
    assert len(cell.recorded()) > entries
    assert cell.recorded(EntryKind.REFUSED)[0].details["code"] == "length_changed"
    touches = cell.recorded(EntryKind.DONE)[0].details["touch"]["touches"]
    assert touches == len(first.document["poses"])
    followed = cell.calibrate(*words, "--if-length-changed", "difference")
    assert followed.code == 0, followed.err
    check_followed(cell, before, followed.document["length"], -longer_mm)
    assert cell.stored.x_mm == pytest.approx(cell.truth.x_mm, abs=0.06)


@pytest.mark.parametrize(
    ("kind", "method"),
    [
        # Of two tools in test_length_changed.py, by a stated height on a PLC below.
        pytest.param("plc", "two-pose", marks=LONG),
        pytest.param("plc", "n-angle", marks=LONG),
        pytest.param("epson", "two-pose", marks=LONG),
        pytest.param("epson", "n-angle", marks=LONG),
    ],
)
def test_a_recipe_tells_it_too(cell, method, tmp_path):
    assert recalibrate(cell, tmp_path, method).code == 0
    before = cell.stored
    cell.lengthen(-0.5)
    refused = recalibrate(cell, tmp_path, method)
    assert (refused.code, refused.document["error"]["code"]) == (7, "length_changed")
    assert cell.stored == before
    followed = recalibrate(cell, tmp_path, method, "difference")
    assert followed.code == 0, followed.err
    check_followed(cell, before, followed.document["tools"][0]["length"], 0.5)


@pytest.mark.parametrize(
    ("kind", "run"),
    [
        ("plc", "recipe"),
        # A command on EPSON below.
        pytest.param("epson", "command", marks=LONG),
        pytest.param("epson", "recipe", marks=LONG),
        pytest.param("plc", "command", marks=LONG),
    ],
)
def test_the_height_that_only_the_cell_file_states_tells_it_at_once(cell, tmp_path, run):
    x_mm, y_mm, z_mm = cell.world.pin_mm
    state_pin(
        cell, f"x_mm = {x_mm:.2f}", f"y_mm = {y_mm:.2f}", f"z_mm = {z_mm:.3f}", "sigma_mm = 0.02"
    )
    before = cell.stored

    def measure(rule=""):
        if run == "recipe":
            return recalibrate(cell, tmp_path, "two-pose", rule)
        said = ("--if-length-changed", rule) if rule else ()
        return cell.calibrate("two-pose", *AT_PIN, "--no-verify", *said)

    off_mm = before.z_mm - cell.truth.z_mm
    cell.lengthen(0.5 - off_mm)
    refused = measure()
    assert (refused.code, refused.document["error"]["code"]) == (7, "length_changed"), refused.err
    assert cell.stored == before
    followed = measure("difference")
    assert followed.code == 0, followed.err
    document = followed.document
    told = document["length"] if run == "command" else document["tools"][0]["length"]
    check_followed(cell, before, told, -0.5)
    # A value that is right by the stated height counts as right.
    again = measure()
    assert again.code == 0, again.err


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        (("z_mm = {z:.3f}", "sigma_mm = 0.3"), None),
        (("z_mm = {z:.3f}",), "length_changed"),
        (("x_mm = {x:.1f}", "y_mm = {y:.1f}", "z_mm = {z:.3f}"), "length_changed"),
        (("x_mm = {aside:.1f}", "y_mm = {y:.1f}", "z_mm = {z:.3f}"), "not where it was"),
        (("x_mm = {x:.1f}", "y_mm = {y:.1f}"), "height of the pin is not"),
    ],
    ids=["unsure", "height only", "about there", "another pin", "has no contact height"],
)
def test_how_sure_a_stated_height_is_decides(tmp_path, monkeypatch, lines, said):
    with method_cell("epson", tmp_path, monkeypatch) as arm:
        x_mm, y_mm, z_mm = arm.world.pin_mm
        state_pin(arm, *(line.format(x=x_mm, y=y_mm, z=z_mm, aside=x_mm + 4) for line in lines))
        before = arm.stored
        arm.lengthen(0.5 - (before.z_mm - arm.truth.z_mm))
        done = arm.calibrate("two-pose", *AT_PIN, "--no-verify")
        if said == "length_changed":
            assert (done.code, done.document["error"]["code"]) == (7, said), done.err
            return
        assert done.code == 0, done.err
        assert arm.stored.z_mm == before.z_mm
        if said is None:
            assert not done.document["length"]["changed"]
        else:
            assert any(said in note for note in done.document["notes"])


@pytest.mark.soak
def test_a_person_on_a_plc_is_asked_once(tmp_path, monkeypatch):
    with method_cell("plc", tmp_path, monkeypatch) as cell:
        words = ("two-pose", "--tool", "1", *AT_PIN, "--assist", cell.cell.url, "--json")
        monkeypatch.setattr(
            "robolink_cli.session.check_before_start.agree_to_motion", lambda *_, **__: None
        )
        asked, answer = [], _operator.AssistedOperator.ask

        def ask(operator, question, kind):
            asked.append(question)
            answer(operator, question, kind)

        monkeypatch.setattr(_operator.AssistedOperator, "ask", ask)
        assert cell.calibrate("two-pose", *AT_PIN).code == 0
        before = cell.stored
        cell.lengthen(0.5)
        asked.clear()
        done = cell.run("calibrate", *words, "--speed", "100")
        assert done.code == 0, done.err
        assert sum(QUESTION in question for question in asked) == 1
        check_followed(cell, before, done.document["length"], -0.5)
