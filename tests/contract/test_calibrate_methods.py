"""Every live method of ``calibrate`` on both kinds of controllers, with good and bad input."""

import signal

import pytest

from robolink.model import EntryKind, ToolOffset
from tests.contract._method_cell import KINDS, method_cell, on

pytestmark = pytest.mark.simulator_only

OLD = ToolOffset(12.0, -3.5, -20.0)
TOUCHES = ("z-touch", "--station", "PLATE", "--speeds", "4,2,4,2,4,2,4")


@pytest.fixture(params=KINDS)
def cell(request, tmp_path, monkeypatch):
    with method_cell(request.param, tmp_path, monkeypatch) as cell:
        yield cell


def within(document, truth, *, axes="xy"):
    """Return whether the truth lies in the stated interval, four times as wide for safety."""
    half = document["fit"]["half_width95"]
    return all(
        abs(document["proposed"][f"{axis}_mm"] - getattr(truth, f"{axis}_mm"))
        <= 4 * half[f"{axis}_mm"] + 0.002
        for axis in axes
    )


@pytest.mark.parametrize("cell", on("epson"), indirect=True)
def test_many_touches_end_early_and_one_touch_finds_the_next_needle(cell):
    done = cell.calibrate("n-angle", "--station", "PIN-07", "--until", "0.05", "--count", "8")
    assert done.code == 0, done.err
    document = done.document
    assert document["method"] == "n-angle"
    assert 4 <= len(document["poses"]) < 8
    assert max(document["fit"]["half_width95"].values()) <= 0.05
    assert within(document, cell.truth)
    assert document["verification"]["passed"]
    assert all(verdict["passed"] for verdict in document["verdicts"])
    assert "One more at U" in done.err
    assert "That is enough" in done.err
    (found,) = cell.recorded(EntryKind.STATION)
    pin, said = cell.world.pin_mm, found.details
    assert (said["x_mm"], said["y_mm"]) == pytest.approx(pin[:2], abs=0.05)
    assert said["sigma_mm"] > 0
    assert found.signature.station == "PIN-07"
    one_touch_gives_the_next_needle(cell)


def one_touch_gives_the_next_needle(cell):
    before, tip = cell.stored, cell.truth
    cell.lengthen(0.4, 0.3, -0.2)
    done = cell.calibrate("one-touch", "--station", "PIN-07")
    assert done.code == 0, done.err
    document = done.document
    # The earlier Z was never measured, so only its change can be right and is stated.
    assert (document["measured"], document["changed"]) == (["x_mm", "y_mm"], ["z_mm"])
    changed = [b - a for a, b in zip(tip.components(), cell.truth.components(), strict=True)]
    proposed = document["proposed"]
    for axis, change, old in zip("xyz", changed, before.components(), strict=False):
        error = proposed[f"{axis}_mm"] - old - change
        halves = document["fit"]["half_width95"]
        half_mm = document["change_z_half95_mm"] if axis == "z" else halves[f"{axis}_mm"]
        assert abs(error) <= 3 * half_mm
    assert document["verification"]["passed"]
    assert document["warnings"] == []


def test_the_chain_asks_for_a_full_calibration_in_time(arm):
    arm.calibrate("n-angle", "--station", "PIN-07", "--count", "4", "--sigma", "0.01")
    halves = []
    for _ in range(2):
        arm.lengthen(0.1)
        done = arm.calibrate("one-touch", "--station", "PIN-07", "--max-changes", "2")
        assert done.code == 0, done.err
        halves.append(done.document["fit"]["half_width95"]["x_mm"])
    # Each starts from the touch of the one before, so the touches between them cancel.
    assert halves[1] == pytest.approx(halves[0])
    assert done.document["fit"]["chain"]["changes"] == 2
    assert "difference 2 since the last full calibration" in done.err
    assert done.document["warnings"] == ["full_calibration_due"]
    assert "A full calibration is due" in done.err
    refused = arm.calibrate("one-touch", "--station", "PIN-07", "--max-interval", "0.02")
    assert refused.code == 7
    assert refused.document["error"]["code"] == "large_interval"
    # A tool that somebody changed has no last touch.
    set_by_hand = ("--x", "1", "--y", "2", "--z", "-20", "--accept-jump", "20")
    assert arm.run("tool", "set", "1", *set_by_hand).code == 0
    refused = arm.calibrate("one-touch", "--station", "PIN-07")
    assert (refused.code, refused.document["error"]["code"]) == (7, "reference_outdated")


def test_one_touch_may_trust_the_place_of_the_pin(arm):
    learn = ("station", "learn", "PIN-07", "--tool", "1", "--assist", arm.cell.url, "--yes")
    one_touch = ("--station", "PIN-07", "--absolute", "--sigma", "0.01", "--no-verify")
    stated, held = arm.truth, arm.stored
    with arm.cell.connected() as controller:
        controller.tools.write(1, stated, expected=held)
    assert arm.run(*learn, "--sigma", "0.01").code == 0
    arm.lengthen(0.1, 0.2)
    done = arm.calibrate("one-touch", *one_touch)
    assert done.code == 0, done.err
    assert within(done.document, arm.truth)
    # A person who compares two tools must know whether both share an error of the pin.
    learnt, measured = arm.recorded(EntryKind.STATION)[0], arm.recorded(EntryKind.CALIBRATION)[0]
    rests_on = {"station": "PIN-07", "entry": learnt.number, "at": learnt.at}
    assert measured.details["station_record"] == rests_on
    # The pin counts in full, in addition to the touch.
    halves = done.document["fit"]["half_width95"]
    assert halves["x_mm"] == pytest.approx(1.96 * 0.01 * 2**0.5, rel=1e-3)
    assert arm.run(*learn).code == 0
    unsure = arm.calibrate("one-touch", *one_touch)
    assert unsure.document["fit"]["half_width95"] == {}


@pytest.mark.parametrize(
    ("method", "station", "axes"), [("beams", "BEAMS-02", "xy"), ("z-touch", "PLATE", "z")]
)
@pytest.mark.parametrize("cell", on("epson"), indirect=True)
def test_a_sensor_measures_at_its_station_and_nobody_is_asked(cell, method, station, axes):
    cell.mount()
    done = cell.calibrate(method, "--station", station)
    assert done.code == 0, done.err
    assert done.document["method"] == method
    assert "station_record" not in cell.recorded(EntryKind.CALIBRATION)[0].details
    found = done.document["proposed"]
    for axis in axes:
        assert found[f"{axis}_mm"] == pytest.approx(getattr(cell.truth, f"{axis}_mm"), abs=0.02)
    assert done.document["verification"]["passed"]
    assert "Nobody touches anything" in done.err
    what, known = ("crossings", "X and Y") if method == "beams" else ("touches", "Z")
    assert f" {what} agree within 0.0" in done.err
    assert f" {known}: repeatable to +-0.0" in done.err
    assert "One more at " in done.err
    proof = "Touched again:" if method == "z-touch" else "Turn test passed:"
    assert proof in done.err
    assert ("is to be checked every 90 days" in done.err) is (station == "BEAMS-02")
    assert cell.recorded(EntryKind.DONE)[0].signature.station == station


@pytest.mark.parametrize(
    ("kind", "words", "which"),
    [
        ("epson", ("beams", "--station", "BEAMS-02", "--repeats", "3"), "Crossing"),
        ("epson", TOUCHES, "Touch"),
        pytest.param("plc", TOUCHES, "Touch", marks=pytest.mark.soak),
    ],
)
def test_a_sensor_stops_inside_the_tolerance_and_its_worst_is_offered_for_retaking(
    tmp_path, monkeypatch, kind, words, which
):
    """The simulated person accepts each offer; the answers are recorded."""
    monkeypatch.setattr(
        "robolink_cli.session.check_before_start.agree_to_motion", lambda *_, **__: None
    )
    with method_cell(kind, tmp_path, monkeypatch) as cell:
        cell.mount()
        course = ("--until", "0.05", "--no-verify", "--tool", "1", "--speed", "100")
        done = cell.run("calibrate", *words, *course, "--assist", cell.cell.url, "--json")
        assert done.code == 0, done.err
        assert "That is enough" in done.err
        assert max(done.document["fit"]["half_width95"].values()) <= 0.05
        said = [entry.details.get("question", "") for entry in cell.recorded(EntryKind.DECISION)]
        *_, first = offered = [str(one) for one in said if "Repeat it" in str(one)]
        assert len(offered) == 3
        assert first.startswith(which)
        assert first.endswith("Repeat it?")
        assert within(done.document, cell.truth, axes="xy" if which == "Crossing" else "z")


@pytest.mark.parametrize("method", ["pivot", "six-point"])
def test_four_axes_cannot_tilt_and_say_so_before_anything_moves(cell, method):
    refused = cell.calibrate(method)
    assert refused.code == 7
    error = refused.document["error"]
    assert error["code"] == "rank_deficient"
    assert "turns its tool about Z only" in error["what"]
    assert cell.stored == OLD


@pytest.mark.parametrize(
    ("words", "code", "named"),
    [
        (("one-touch", "--station", "PIN-99"), 2, "no station 'PIN-99'"),
        (("one-touch", "--station", "PLATE"), 2, "of kind touch; pin is needed"),
        (("one-touch", "--station", "PIN-07"), 7, "no_last_touch"),
        (("one-touch", "--station", "PIN-07", "--absolute"), 2, "its place must be known first"),
        (("beams", "--station", "PIN-07"), 2, "of kind pin; beams is needed"),
        (("beams", "--station", "BEAMS-02", "--search", "6"), 2, "must be larger than --search"),
        (("beams", "--station", "BEAMS-02"), 7, "no_edge"),
        (("z-touch", "--station", "PLATE"), 7, "no_edge"),
        (("z-touch", "--station", "PLATE", "--speeds", "2"), 2, "must hold at least 2"),
        (("beams", "--station", "BEAMS-02", "--until", "0.01"), 2, "has nothing to leave out"),
        (("z-touch", "--station", "PLATE", "--until", "0.01"), 2, "has nothing to leave out"),
        (("n-angle", "--angles", "0,90"), 2, "must hold at least 3"),
        (("n-angle", "--angles", "0,10,370"), 2, "must be at most 360"),
        (("n-angle", "--angles", "0,10,20", "--no-verify"), 2, "must spread over at least 30"),
        (("n-angle", "--station", "PLATE"), 2, "of kind touch; pin is needed"),
        (("n-angle", "--box", "5"), 2, "would leave the allowed area"),
        (("n-angle", "--max-rms", "0.0005"), 7, "large_rms"),
    ],
)
def test_what_cannot_be_is_refused_and_nothing_is_written(arm, words, code, named):
    method, *more = words
    refused = arm.calibrate(method, *more)
    assert refused.code == code, refused.err
    error = refused.document["error"]
    assert named in (error.get("code"), *error["what"].splitlines()) or named in error["what"]
    assert arm.stored == OLD


def test_a_dry_run_lists_every_step_and_moves_nothing(arm):
    shown = arm.calibrate("n-angle", "--count", "4", "--until", "0.5", "--dry-run")
    assert shown.code == 0, shown.err
    steps = shown.document["steps"]
    assert sum(step["target"] is None for step in steps) == 4
    assert not any(step["refusal"] for step in steps)
    assert arm.recorded() == []


def test_a_bumped_pin_is_told_from_a_moved_tip(arm):
    nozzle = ("--nozzle", "N-1")
    assert arm.calibrate("n-angle", "--station", "PIN-07", "--count", "4", *nozzle).code == 0
    arm.bump_pin(0.3, -0.2)
    doubted = arm.calibrate("one-touch", "--station", "PIN-07", "--no-verify", *nozzle)
    assert "station_moved" in doubted.document["warnings"]
    found = arm.calibrate("n-angle", "--station", "PIN-07", "--count", "4", *nozzle)
    assert found.code == 0, found.err
    assert "station_moved" in found.document["warnings"]
    assert within(found.document, arm.truth)
    assert "seems to have moved" in found.err
    arm.lengthen(0.0, 0.3, 0.2)
    moved = arm.calibrate("n-angle", "--station", "PIN-07", "--count", "4", "--nozzle", "N-2")
    assert moved.document["warnings"] == []


def test_ctrl_c_in_a_touch_leaves_the_old_value_and_the_tool_of_before(cell):
    count = 0

    def strike(*_):
        nonlocal count
        count += 1
        if count == 40:
            signal.raise_signal(signal.SIGINT)

    cell.cell.simulator.on_request = strike
    ended = cell.calibrate("n-angle", "--count", "4")
    assert ended.code == 130
    cell.cell.simulator.on_request = None
    assert cell.stored == OLD
    with cell.cell.connected() as controller:
        assert controller.tools.selected() == 1
        assert controller.outcomes.open_markers() == ()
