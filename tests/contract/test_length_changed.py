"""A tip of another length shows in its touch heights and is asked about once, never ignored."""

import json

import pytest
from robolink_cli.prompts import operator as _operator

from robolink.model import EntryKind, ToolOffset

pytestmark = pytest.mark.simulator_only

AT_PIN = ("--station", "PIN-07")
THREE = ("--count", "3", *AT_PIN)
TWO = ("two-pose", *AT_PIN)
NO_PROOF = "--no-verify"
"""For runs that only record touches or are refused. Runs that change a length are verified."""


def seen_at_touch_1(err):
    """Return how much longer the needle was said to be, mm; said once, between two touches."""
    before, said, after = err.partition("The needle seems ")
    assert said, err
    assert "The needle seems" not in after
    assert "Jog the tip onto the pin again" not in before
    assert "Turning in the air." in after
    mm, _, way = after.partition(" mm ")
    assert way.startswith(("longer than the old one", "shorter than the old one"))
    return float(mm) * (1 if way.startswith("longer") else -1)


def station_z(arm):
    return arm.recorded(EntryKind.STATION)[0].details["z_mm"]


def test_z_follows_the_heights_or_is_kept_where_that_was_decided(arm):
    first = arm.calibrate("n-angle", *THREE, NO_PROOF)
    assert first.code == 0
    assert "needle seems" not in first.err, "nothing is on record that it could be seen against"
    before = arm.stored
    arm.lengthen(-0.5)
    followed = arm.calibrate("n-angle", *THREE, "--if-length-changed", "difference")
    assert followed.code == 0, followed.err
    assert arm.stored.z_mm - before.z_mm == pytest.approx(0.5, abs=0.12)
    told = followed.document["length"]
    assert told["changed"]
    assert told["written"] == "difference"
    assert "length_changed" in followed.document["warnings"]
    assert seen_at_touch_1(followed.err) == pytest.approx(-0.5, abs=0.2)
    # Now Z is right for this tip, and there is nothing to report.
    again = arm.calibrate("n-angle", *THREE)
    assert again.code == 0, again.err
    assert not again.document["length"]["changed"]
    assert "seems about as long as the old one: touch 1 shows no" in again.err
    assert again.document["warnings"] == ["few_poses"]
    # Kept on purpose it stays, and that is recorded.
    before = arm.stored
    arm.lengthen(0.5)
    kept = arm.calibrate("n-angle", *THREE, "--if-length-changed", "keep")
    assert kept.code == 0, kept.err
    assert arm.stored.z_mm == before.z_mm
    assert kept.document["length"]["written"] == "keep"
    said = [entry.details.get("length") for entry in arm.recorded(EntryKind.DECISION)]
    assert "keep" in said


def test_small_changes_do_not_add_up_unseen(arm):
    """Each change is below the limit; compared with the last run alone, none would ever show."""
    codes: list[int] = []
    while len(codes) < 4 and 7 not in codes:
        codes.append(arm.calibrate("n-angle", *THREE, NO_PROOF).code)
        arm.lengthen(0.08)
    assert codes[0] == 0
    assert codes[1] == 0, "one alone is below what touches tell"
    assert 7 in codes


def test_a_person_is_asked_once_with_both_values(arm, monkeypatch):
    assert arm.calibrate("n-angle", *THREE, NO_PROOF).code == 0
    monkeypatch.setattr(
        "robolink_cli.session.check_before_start.agree_to_motion", lambda *_, **__: None
    )
    asked, answer, says_yes = [], _operator.AssistedOperator.ask, [True]

    def ask(operator, question, kind):
        asked.append(question)
        answer(operator, question, kind)

    def confirm(runner, question):
        asked.append(question)
        return says_yes[0] or "instead of keeping" not in question

    monkeypatch.setattr(_operator.AssistedOperator, "ask", ask)
    monkeypatch.setattr("robolink.runner.Runner.confirm", confirm)
    for says_yes[0], by_mm in ((True, -0.5), (False, 0.0)):
        before = arm.stored
        arm.lengthen(0.5)
        asked.clear()
        done = arm.run(
            "calibrate", "n-angle", "--tool", "1", *THREE, "--no-retake", "--speed", "100",
            "--assist", arm.cell.url, "--json", NO_PROOF,
        )  # fmt: skip
        assert done.code == 0, done.err
        questions = [question for question in asked if "instead of keeping" in question]
        assert len(questions) == 1
        assert f"keeping {before.z_mm:.3f}" in questions[0]
        assert arm.stored.z_mm - before.z_mm == pytest.approx(by_mm, abs=0.12)


def test_the_height_of_a_pin_is_never_learnt_from_a_z_that_was_kept(arm):
    assert arm.calibrate(*TWO, NO_PROOF).code == 0
    assert station_z(arm) is None
    with arm.cell.connected() as controller:
        controller.tools.write(2, ToolOffset(12.0, -3.5, -19.0), expected=None)
    arm.world.tips[2] = ToolOffset(12.2, -3.4, -20.3)
    # Tool 2 has no touch there, and no trustworthy source gives the height of the pin.
    second = arm.calibrate(*TWO, NO_PROOF, tool=2)
    assert second.code == 0, second.err
    assert second.document["length"] is None
    assert any("height of the pin is not" in note for note in second.document["notes"])


def test_a_pin_of_known_height_shows_that_another_tool_s_z_is_wrong(arm):
    learn = ("station", "learn", "PIN-07", "--tool", "1", "--assist", arm.cell.url, "--yes")
    assert arm.calibrate(*TWO, NO_PROOF).code == 0
    # Z of tool 1 was never shown, so it shows no height either.
    assert "was never measured" in arm.run(*learn).err
    assert station_z(arm) is None
    stated, held = replace_z(arm.truth, 0.0), arm.stored
    with arm.cell.connected() as controller:
        controller.tools.write(1, stated, expected=held)
    learnt = arm.run(*learn)
    assert learnt.code == 0, learnt.err
    assert station_z(arm) == pytest.approx(arm.world.pin_mm[2], abs=0.1)
    wrong = replace_z(arm.stored, -1.0)
    with arm.cell.connected() as controller:
        controller.tools.write(2, wrong, expected=None)
    arm.world.tips[2] = arm.truth
    refused = arm.calibrate(*TWO, tool=2)
    assert refused.document["error"]["code"] == "length_changed"
    followed = arm.calibrate(*TWO, "--if-length-changed", "difference", tool=2)
    assert followed.code == 0, followed.err
    followed_z = arm.held(2)
    assert followed_z is not None
    assert followed_z.z_mm == pytest.approx(arm.stored.z_mm, abs=0.15)
    assert "shorter than the stored value says" in followed.err
    # The height of the pin stays as it was: tool 2 followed it.
    heights = [entry.details["z_mm"] for entry in arm.recorded(EntryKind.STATION)]
    assert heights[0] == heights[1]


def replace_z(offset, by_mm):
    return ToolOffset(offset.x_mm, offset.y_mm, offset.z_mm + by_mm)


def test_on_a_pin_that_moved_a_length_is_not_told_and_that_is_said(arm):
    nozzle = ("--nozzle", "N-1", NO_PROOF)
    assert arm.calibrate(*TWO, *nozzle).code == 0
    before = arm.stored
    arm.bump_pin(0.4, -0.3)
    arm.lengthen(0.5)
    done = arm.calibrate(*TWO, *nozzle)
    assert done.code == 0, done.err
    assert done.document["length"] is None
    assert any("not where it was" in note for note in done.document["notes"])
    assert arm.stored.z_mm == before.z_mm


RECIPE = """
schema = "robolink/recipe/1"
name = "two nozzles"
basis = "absolute"
z = "kept"
verify = false

[source]
kind = "two-pose"
{more}

[station]
id = "PIN-07"

[speeds]
percent = 100
mm_s = 100

[[tools]]
number = 1

[[tools]]
number = 2
"""


def test_a_recipe_refuses_too_and_may_say_it_beforehand(arm, tmp_path):
    with arm.cell.connected() as controller:
        controller.tools.write(2, ToolOffset(12.4, -3.7, -20.0), expected=None)
    arm.world.tips[2] = ToolOffset(12.3, -3.8, -20.2)
    asking, deciding = tmp_path / "asking.toml", tmp_path / "deciding.toml"
    asking.write_text(RECIPE.format(more=""))
    deciding.write_text(RECIPE.format(more='if_length_changed = "difference"'))

    def run(path):
        return arm.run("recalibrate", str(path), "--assist", arm.cell.url, "--yes", "--json")

    done = run(asking)
    assert done.code == 0, done.err
    held = [arm.held(tool) for tool in (1, 2)]
    arm.lengthen(0.6, tool=2)
    refused = run(asking)
    assert refused.document["error"]["code"] == "length_changed"
    assert "tool 2" in refused.document["error"]["what"]
    assert [arm.held(tool) for tool in (1, 2)] == held
    done = run(deciding)
    assert done.code == 0, done.err
    now = [arm.held(tool) for tool in (1, 2)]
    assert now[0].z_mm == held[0].z_mm
    assert now[1].z_mm - held[1].z_mm == pytest.approx(-0.6, abs=0.12)
    # Both by the same amount: two equal needles, or the pin was pressed down. No length is
    # reported.
    arm.lengthen(0.4, tool=1)
    arm.lengthen(0.4, tool=2)
    unsure = run(deciding)
    assert unsure.code == 0, unsure.err
    for tool in unsure.document["tools"]:
        assert any("it may be the pin" in note for note in tool["notes"])
    assert json.loads(unsure.out)["tools"][0]["length"] is None
