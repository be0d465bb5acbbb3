"""demo --eye: the source with which a demonstrated nozzle is found in drawn pictures."""

import math

import pytest
from robolink_cli.commands.simulate.demo_eye import DemoEye

from robolink.model import TIP, StationSensor
from tests.unit._drawn_cells import cell_before_camera, place_px


@pytest.mark.parametrize("kind", ["epson", pytest.param("softmotion", marks=pytest.mark.soak)])
def test_the_eye_of_the_demonstration_sees_the_tip_over_http(kind, capsys):
    simulator = cell_before_camera(kind)
    eye = DemoEye(simulator)
    with eye.source() as source:
        sensor, station = source.sensor, source.station
        assert isinstance(sensor, StationSensor)
        (spot,) = sensor.at_station(station.details, None).see(TIP)
    assert (spot.x, spot.y) == pytest.approx(place_px(simulator), abs=0.2)
    assert eye.pictures >= 2
    assert "http://127.0.0.1:" in capsys.readouterr().out
    x_mm, y_mm, _ = simulator.world.camera.middle_mm
    # Nobody puts a station exactly where the camera looks.
    assert 0.1 < math.hypot(station.x_mm - x_mm, station.y_mm - y_mm) < 1.0
