"""A learnt station keeps its uncertainty, and results that use the station include it."""

from types import SimpleNamespace
from typing import Any

import pytest

from robolink.calibration import AccuracyFacts, Pin, RowFact, assessed, solve_one_touch
from robolink.calibration_run import AcceptanceCriteria
from robolink.calibration_run._repeatability import (
    MOST_CHANGES,
    Seating,
    seating_of,
    touch_sigma_z_mm,
)
from robolink.errors import CalibrationError
from robolink.journal import memory_journal
from robolink.model import EntryKind, NewEntry, Pose, ToolOffset, plain_offset
from robolink.stations import (
    Found,
    Station,
    StationKind,
    beam_station,
    camera_station,
    pin_of,
    station_entry,
)

pytestmark = pytest.mark.simulator_only


@pytest.mark.parametrize("shaft_mm", ["0", pytest.param("3", marks=pytest.mark.soak)])
def test_beams_that_were_learnt_carry_their_uncertainty_into_the_tip(arm, shaft_mm):
    arm.mount()
    words = ("beams", "--station", "BEAMS-02", "--sigma", "0.002", "--shaft", shaft_mm)
    before = arm.calibrate(*words, "--no-verify")
    assert before.code == 0, before.err
    # Intervals of two draws may differ by half, so one is compared with what the place alone makes.
    arm.cell.mount_beams(arm.cell.beams(), noise_mm=0.016)
    learn = ("station", "learn", "BEAMS-02", "--tool", "1", "--assist", arm.cell.url, "--yes")
    assert arm.run(*learn, "--json").code == 0
    arm.mount()
    details = arm.recorded(EntryKind.STATION)[0].details
    for line, heading in zip(details["beams"], (3.0, 88.0), strict=True):
        assert line["direction_deg"] == pytest.approx(heading, abs=0.2)
        assert line["sigma_mm"] > 0
        assert line["direction_sigma_deg"] > 0
        assert line["dof"] > 0
    after = arm.calibrate(*words, "--no-verify")
    assert after.code == 0, after.err
    halves = [done.document["fit"]["half_width95"]["x_mm"] for done in (before, after)]
    of_the_place = 1.9 * max(line["sigma_mm"] for line in details["beams"])
    assert halves[1] > of_the_place > halves[0]


def test_a_pin_keeps_its_covariance_and_a_record_of_before_is_read():
    full = Station(
        id="P",
        kind=StationKind.PIN,
        x_mm=1.0,
        y_mm=2.0,
        z_mm=3.0,
        sigma_mm=0.03,
        details={"covariance_mm2": [[4e-4, 1e-5], [1e-5, 1e-4]]},
    )
    assert pin_of(full).covariance_mm2 == ((4e-4, 1e-5, 0.0), (1e-5, 1e-4, 0.0), (0.0, 0.0, 9e-4))
    old = Station(id="P", kind=StationKind.PIN, x_mm=1.0, y_mm=2.0, z_mm=3.0, sigma_mm=0.03)
    assert pin_of(old).covariance_mm2 == ()
    assert pin_of(old).sigma_mm == 0.03


def test_cameras_and_beams_of_before_are_read():
    line = {"input": 3, "x_mm": 1.0, "y_mm": 2.0, "direction_deg": 3.0}
    details = {"beams": [line, {**line, "direction_deg": 90.0}]}
    beams = beam_station(Station(id="B", kind=StationKind.BEAMS, z_mm=0.0, details=details)).beams
    assert [beam.sigma_mm for beam in beams] == [0.0, 0.0]
    seen = {"mm_per_px": [[0.02, 0.0], [0.0, -0.02]], "origin_mm": [1.0, 2.0]}
    here = (10.0, 20.0, 0.0)
    old = Station(id="C", kind=StationKind.CAMERA, details=seen).at(*here, sigma_mm=0.01)
    assert camera_station(old).require_model().sigma_at_mm(0.0, 0.0) == 0.01
    known = {**seen, "centre_mm": [10.0, 20.0], "place_sigma_mm": 0.003, "scale_sigma": 0.001}
    new = Station(id="C", kind=StationKind.CAMERA, details=known).at(*here, sigma_mm=0.01)
    # 4 mm from the centre, the scale error counts 0.004 mm.
    assert camera_station(new).require_model().sigma_at_mm(14.0, 20.0) == pytest.approx(0.005)


def test_what_is_learnt_is_written_as_plain_json():
    details = {"covariance_mm2": [[1e-4, 0.0], [0.0, 1e-4]], "z_from": ""}
    found = Found(id="P", kind=StationKind.PIN, x_mm=1.0, y_mm=2.0, details=details)
    assert station_entry(found).details["covariance_mm2"] == details["covariance_mm2"]


def test_the_limit_of_a_process_is_compared_with_the_region():
    pin = Pin(101.0, 2.0, 3.0, 0.01)
    found = solve_one_touch(Pose(100.0, 0.0, 0.0, 0.0), pin, sigma_mm=0.01)
    # 1.96 and 2.80 times 0.014: each axis alone, and all three together.
    assert found.half95_mm == pytest.approx(0.0277, abs=1e-4)
    assert found.region95_radius_mm == pytest.approx(0.0395, abs=1e-4)
    rows = {key: RowFact(0.0001, "stated") for key in ("touch_mm", "place_mm")}
    found = assessed(found, AccuracyFacts(rows))
    AcceptanceCriteria(interval_mm=0.041).judge_fit(found)
    with pytest.raises(CalibrationError, match="Accurate to") as refused:
        AcceptanceCriteria(interval_mm=0.03).judge_fit(found)
    assert refused.value.code == "large_interval"


def kept(number, x_mm, z_mm, z_from, nozzle):
    """Return the journal entry of a kept value at a pin."""
    details = {
        "tip": plain_offset(ToolOffset(x_mm, -3.5, z_mm)),
        "touch": {"station": "PIN-07"},
        "z_from": z_from,
        "nozzle": nozzle,
    }
    return NewEntry(EntryKind.DECISION, tool=number, verdict="", details=details)


def test_how_nozzles_sit_is_pooled_from_eight_changes_on_record(arm):
    places = [0.0, 0.3, 0.0, 0.3, 0.0, 0.3, 0.0, 0.3]
    with arm.cell.connected() as controller:
        for number, x_mm in enumerate(places):
            controller.outcomes.append(kept(1, x_mm, -20.0, "kept", f"N-{number}"))
        # Seven changes, and the same nozzle mounted again, which shows nothing.
        controller.outcomes.append(kept(1, 0.0, -20.0, "kept", "N-7"))
        assert seating_of(controller) == Seating()
        controller.outcomes.append(kept(1, 0.3, -20.0, "kept", "N-8"))
        found = seating_of(controller)
    assert found.changes == 8
    # X moved by 0.3 in each, Y by nothing; a kept Z does not show that Z seats alike.
    assert found.sigma_mm == pytest.approx((0.3 / 2**0.5, 0.3 / 2**0.5, 0.05))


def test_no_more_of_a_long_record_is_read_than_counts():
    read, log = [], memory_journal("a-long-record").log("a-long-record")
    log.append(*(kept(1, 0.3 * (n % 2), -20.0, "kept", f"N-{n}") for n in range(200)))

    def recorded(**wanted):
        for entry in log.recorded(**wanted):
            read.append(entry)
            yield entry

    controller: Any = SimpleNamespace(outcomes=SimpleNamespace(recorded=recorded))
    assert seating_of(controller).changes == MOST_CHANGES
    assert len(read) == MOST_CHANGES + 1


def test_how_well_touches_repeat_in_height_is_pooled_from_ten_of_them(arm):
    with arm.cell.connected() as controller:
        assert touch_sigma_z_mm(controller, "PIN-07") == 0.05
        for run in range(4):
            touch = {"station": "PIN-07", "heights_mm2": 0.0012, "heights_dof": 3}
            touch["heights_by"] = "person"
            controller.outcomes.append(
                NewEntry(EntryKind.DECISION, tool=1, verdict="", details={"touch": touch})
            )
            assert touch_sigma_z_mm(controller, "OTHER") == 0.05
            pooled = touch_sigma_z_mm(controller, "PIN-07")
            assert pooled == pytest.approx(0.02 if run == 3 else 0.05)
    assert arm.calibrate("n-angle", "--station", "PIN-07", "--count", "3").code == 0
    touch = arm.recorded(EntryKind.DONE)[0].details["touch"]
    assert touch["heights_dof"] == 2
    assert touch["heights_mm2"] > 0
