"""What a station is unsure of is kept when it is learnt, and is in the results that use it."""

import pytest

from robolink.journal import EntryKind
from robolink.stations import (
    Found,
    Station,
    StationKind,
    beam_station,
    camera_station,
    pin_of,
    station_entry,
)
from tests.contract._method_cell import method_cell

pytestmark = pytest.mark.simulator_only


@pytest.fixture
def arm(tmp_path, monkeypatch):
    with method_cell("epson", tmp_path, monkeypatch) as cell:
        yield cell


def test_beams_that_were_learnt_carry_their_uncertainty_into_the_tip(arm):
    arm.mount()
    before = arm.calibrate("beams", "--station", "BEAMS-02", "--sigma", "0.002", "--no-verify")
    assert before.code == 0, before.err
    learn = ("station", "learn", "BEAMS-02", "--tool", "1", "--assist", arm.cell.url, "--yes")
    assert arm.run(*learn, "--json").code == 0
    details = arm.recorded(EntryKind.STATION)[0].details
    for line in details["beams"]:
        assert line["sigma_mm"] > 0
        assert line["direction_sigma_deg"] > 0
        assert line["dof"] > 0
    after = arm.calibrate("beams", "--station", "BEAMS-02", "--sigma", "0.002", "--no-verify")
    assert after.code == 0, after.err
    halves = [done.document["fit"]["half_width95"]["x_mm"] for done in (before, after)]
    assert halves[1] > halves[0]


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
    # 4 mm from the centre, the scale counts 0.004 mm.
    assert camera_station(new).require_model().sigma_at_mm(14.0, 20.0) == pytest.approx(0.005)


def test_what_is_learnt_is_written_as_plain_json():
    details = {"covariance_mm2": [[1e-4, 0.0], [0.0, 1e-4]], "z_from": ""}
    found = Found(id="P", kind=StationKind.PIN, x_mm=1.0, y_mm=2.0, details=details)
    assert station_entry(found).details["covariance_mm2"] == details["covariance_mm2"]
