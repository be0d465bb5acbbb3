"""A program that calls back with edges of beams, or with sightings of its camera."""

from dataclasses import replace

import pytest
from robolink_simulators.epson.camera_calibrations import VisionCalibration

from robolink import runtime
from robolink.journal import memory_journal
from robolink.model import EntryKind, ToolOffset, new_operation
from robolink.protocols.spel_callback import CallbackLine, CallbackWord
from robolink.serving import CallbackConversation, CallbackLimits
from tests.faults._callback_sensors import FIRST, LOOKS, BeamCell, CameraCell

KEPT = [
    EntryKind.INTENT,
    EntryKind.CALIBRATION,
    EntryKind.WRITE,
    EntryKind.VERIFY,
    EntryKind.DONE,
]
BACK = [*KEPT[:3], EntryKind.REFUSED, EntryKind.ROLLED_BACK]


@pytest.fixture
def beams(tmp_path):
    made = BeamCell(tmp_path)
    made.change_needle()
    yield made
    made.close()


@pytest.fixture
def camera(tmp_path):
    made = CameraCell(tmp_path)
    made.change_needle()
    yield made
    made.close()


def kinds_of(cell):
    kinds = [entry.kind for entry in reversed(cell.entries())]
    return [kind for kind in kinds if kind is not EntryKind.STATION]


def refused(cell, code, kinds):
    """Check that the old tool stays, and that the journal gives the reason."""
    old = cell.tool
    assert cell.run() == [code]
    assert cell.tool.rounded(3) == old.rounded(3)
    assert kinds_of(cell) == kinds
    assert cell.entries(EntryKind.REFUSED)[0].details["code"] == code
    assert cell.open_markers() == []


def kept(cell, within_mm):
    before = cell.error_mm
    assert before > 0.2
    assert cell.run() == ["kept"]
    assert cell.error_mm < within_mm
    assert kinds_of(cell) == KEPT
    assert cell.open_markers() == []
    assert max(map(len, cell.calls.questions + cell.calls.answers)) <= 255
    (entry,) = cell.entries(EntryKind.CALIBRATION)
    return entry.details


def test_beams_are_crossed_solved_proved_kept_and_on_record(beams):
    details = kept(beams, 0.01)
    assert len(details["crossings"]) == 12
    assert 0 < details["known_within_mm"] < 0.03


@pytest.mark.soak
def test_a_beam_that_was_not_broken_gives_no_value(beams):
    beams.simulator.world.disconnect(4)
    refused(beams, "no_edge", [EntryKind.REFUSED])


@pytest.mark.soak
def test_a_beam_that_is_always_broken_saw_nothing(beams):
    beams.simulator.world.disconnect(4)
    beams.simulator.machine.inputs.set(4, on=True)
    refused(beams, "no_edge", [EntryKind.REFUSED])


def test_beams_that_were_moved_since_they_were_learnt_show_in_the_proof(beams):
    """The residuals of the measurement are as small as before."""
    x, y, z = beams.recorded_mm
    beams.stand_at((x + 0.15, y, z))
    refused(beams, "drift", BACK)


@pytest.mark.parametrize(
    ("moved_mm", "code"),
    [(0.05, "proof_contradicts_accuracy"), (0.03, "proof_contradicts_repeatability")],
)
def test_a_proof_inside_its_tolerance_that_contradicts_the_measurement_is_none(
    beams, moved_mm, code
):
    x, y, z = beams.recorded_mm
    beams.stand_at((x + moved_mm, y, z))
    refused(beams, code, BACK)


def test_beams_that_were_learnt_long_ago_are_not_sure_enough(beams, monkeypatch):
    """The row of their place has grown to 0.1 mm since, and the limit is 0.1 mm."""
    ahead_s = 400 * 86_400.0
    now_s = runtime.wall_s
    monkeypatch.setattr(runtime, "wall_s", lambda: now_s() + ahead_s)
    refused(beams, "uncertain", [EntryKind.REFUSED])


@pytest.mark.soak
def test_a_bent_needle_is_refused(beams):
    world = beams.simulator.world
    world.set_up(replace(world.parameters, lean_deg=6.0))
    refused(beams, "bent_needle", [EntryKind.REFUSED])


@pytest.mark.soak
def test_a_needle_that_leans_a_little_is_corrected_by_its_shaft(beams):
    world = beams.simulator.world
    world.set_up(replace(world.parameters, lean_deg=1.5, lean_toward_deg=50.0))
    kept(beams, 0.025)


@pytest.mark.soak
def test_without_deeper_crossings_nobody_knows_where_the_tip_is(beams):
    beams.store(FIRST, beams.scans(20.0) + beams.scans(20.0)[:4])
    refused(beams, "shaft_not_crossed", [EntryKind.REFUSED])


@pytest.mark.soak
def test_a_proof_at_the_angle_of_the_measurement_proves_nothing(beams):
    beams.store(200, beams.scans(20.0)[:4])
    refused(beams, "insufficient_rotation", BACK)


def test_a_camera_looks_at_the_tip_and_that_is_proved_kept_and_on_record(camera):
    details = kept(camera, 0.02)
    # Beside each place, and at it.
    assert len(details["seen"]) == 2 * len(LOOKS)
    assert 0 < details["known_within_mm"] < 0.05


@pytest.mark.soak
def test_a_tip_that_is_not_seen_gives_no_value(camera):
    world = camera.simulator.world
    world.set_up(replace(world.parameters, camera_miss_share=1.0))
    refused(camera, "tip_not_seen", [EntryKind.REFUSED])


@pytest.fixture
def frozen(tmp_path):
    """A camera that takes one picture and returns it each time."""
    runs = "VRun findTip\n"
    made = CameraCell(
        tmp_path, main=CameraCell.main.replace(runs, f"{runs}VSet findTip.RuntimeAcquire, 0\n")
    )
    made.change_needle()
    yield made
    made.close()


def test_a_picture_that_stands_still_shows_no_offset(frozen):
    """It agrees with any offset that the tool turns about: the old one would be confirmed."""
    refused(frozen, "picture_stands_still", [EntryKind.REFUSED])


def scaled(truth, factor):
    """Return the calibration of a camera as if its pixels were longer."""
    right = VisionCalibration.of_camera(truth)
    (a, b), (c, d) = right.mm_per_px
    longer = ((a * factor, b * factor), (c * factor, d * factor))
    middle = truth.middle_mm[:2]
    origin = tuple(m + factor * (o - m) for o, m in zip(right.origin_mm, middle, strict=True))
    return replace(right, mm_per_px=longer, origin_mm=origin)


def still(camera, **faults):
    world = camera.simulator.world
    world.set_up(replace(world.parameters, camera_still_share=1.0, **faults))


def test_a_spot_that_stands_still_gives_no_value_though_no_two_pictures_are_alike(camera):
    """It confirmed whatever offset the points were taught with."""
    still(camera)
    refused(camera, "tip_did_not_move", [EntryKind.REFUSED])


@pytest.mark.soak
def test_a_spot_that_stands_still_in_the_proof_brings_the_old_value_back(camera):
    still(camera, camera_still_from_picture=1 + 2 * len(LOOKS))
    refused(camera, "tip_did_not_move", BACK)


@pytest.mark.soak
@pytest.mark.parametrize("factor", [1.05, 0.8])
def test_a_camera_of_a_wrong_scale_shows_in_each_way_to_a_place(camera, factor):
    """Turned 4 mm beside the tip, its circle is too large by as much, and no residual shows it."""
    camera.see(scaled(camera.simulator.world.camera, factor))
    camera.look_from(11, LOOKS, ToolOffset(8.0, -3.5, -20.0))
    refused(camera, "camera_changed", [EntryKind.REFUSED])


@pytest.mark.soak
def test_a_scale_that_no_way_shows_is_seen_when_the_tool_turns_about_the_new_tip(camera):
    camera.see(scaled(camera.simulator.world.camera, 1.018))
    camera.look_from(11, LOOKS, ToolOffset(18.0, -3.5, -20.0))
    refused(camera, "drift", BACK)


@pytest.mark.soak
def test_looks_without_one_beside_each_place_show_nothing(tmp_path):
    beside = "Go P(i) -X(1) -Y(1)"
    made = CameraCell(tmp_path, main=CameraCell.main.replace(beside, "Go P(i)"))
    made.change_needle()
    refused(made, "no_look_beside", [EntryKind.REFUSED])
    made.close()


@pytest.mark.soak
def test_a_proof_that_does_not_turn_about_the_new_tip_is_none(camera):
    camera.look_from(21, (40.0, -40.0, 110.0), ToolOffset(6.0, 0.0, 0.0))
    refused(camera, "not_turned_about_the_tip", BACK)


@pytest.mark.parametrize(
    ("method", "code"),
    [
        ("beams@attic", "station_unknown"),
        ("beams", "unknown_method"),
        ("camera@attic", "unknown_method"),
        ("two-pose", "unknown_method"),
    ],
)
def test_a_method_or_a_station_that_nobody_knows_is_refused(method, code):
    talk = CallbackConversation(memory_journal(new_operation()), CallbackLimits(), peer="here")
    hello = ("S1", "1", "0", "-", "0", *["0"] * 7)
    assert talk.answer(CallbackLine(1, CallbackWord.HELLO, hello)).word is CallbackWord.WELCOME
    begin = ("1", method, "1", *["0"] * 6)
    answer = talk.answer(CallbackLine(2, CallbackWord.BEGIN, begin))
    assert (answer.word, answer.fields) == (CallbackWord.REFUSE, (code,))
