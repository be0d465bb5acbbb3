"""Simulated cells whose pictures a GigE camera takes, and what becomes of their faults."""

import random
from contextlib import ExitStack
from dataclasses import replace
from typing import Any

import pytest
from robolink_cli.commands.simulate.cells_file import read_cells
from robolink_cli.commands.simulate.sim import sim
from robolink_cli.commands.simulate.sim_run import made
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.pictures.camera import DrawnCamera
from robolink_simulators.pictures.gige_camera import drawn_gige_camera

from robolink.errors import CalibrationError, ConfigError
from robolink.eye.cameras.gige.opening import open_gige
from robolink.eye.opening import open_source
from robolink.sensing import open_sensor
from tests.certificate.live import change
from tests.contract._camera_cell import run_source, stored_in
from tests.eye.cells import METHODS, course
from tests.eye.cells import fault as put
from tests.eye.gige._scene import ADDRESS
from tests.eye.gige.conftest import alone

URL = f"gige://{ADDRESS}"
FAULTS: dict[str, tuple[Any, str]] = {
    "picture_halved": (True, "packets_lost"),
    "picture_slow_s": (60.0, "picture_late"),
    "picture_gone": (True, "camera_gone"),
}


HARMLESS: dict[str, Any] = {"picture_halved": False, "picture_slow_s": 0.0, "picture_gone": False}


@pytest.mark.parametrize("url", ["gige://a/b", "gige://user@host", "gige://x?y=1"])
def test_a_url_that_names_no_camera_is_refused(url):
    with pytest.raises(ConfigError, match="names no GigE camera") as caught:
        open_source(url)
    assert "gige://192.168.1.20" in caught.value.remedy


def test_a_cell_serves_its_pictures_as_a_gige_camera(library, tmp_path):
    path = tmp_path / "cells.toml"
    path.write_text(
        'schema = "robolink/sim-cells/1"\n[cells.a]\nkind = "epson"\ntcp = "127.0.0.1:0"\n'
        f'camera = "127.0.0.1:0"\ncamera_gige = "{ADDRESS}"\n'
    )
    (cell,) = read_cells(path, sim.commands)
    (simulator,) = made([cell]).values()
    with ExitStack() as stack:
        stack.enter_context(alone())
        served = cell.kind.serve(stack, simulator, cell.given, person=False)
        camera = served.document("http://127.0.0.1:1")["camera"]
        assert isinstance(camera, dict)
        assert camera["url"].endswith("snapshot.pgm")
        assert camera["urls"]["gige"] == URL
        assert URL in served.pictures.told
        with open_sensor(URL) as sensor:
            assert sensor.identity.startswith("gige Aravis Fake SIM-")
        assert served.requests == 0


def test_each_fault_of_the_world_has_its_name(library):
    """None of these pictures arrives whole, so however small the system's buffer is."""
    simulator = EpsonSimulator()
    camera = DrawnCamera(simulator)
    with alone(), drawn_gige_camera(camera, ADDRESS) as served:
        assert served.document()["size_px"] == [1280, 1024]
        for name, (value, code) in FAULTS.items():
            world = simulator.world
            world.set_up(replace(world.parameters, **{**HARMLESS, name: value}))
            source = open_gige(ADDRESS, patience_s=3.0)
            with pytest.raises(CalibrationError) as caught:
                source.take()
            source.close()
            assert caught.value.code == code
        assert served.failed is None


@pytest.mark.soak
@pytest.mark.timeout(900)
@pytest.mark.parametrize("kind", ["EPSON", "PLC"])
@pytest.mark.parametrize("method", METHODS)
def test_a_nozzle_is_changed_by_pictures_of_a_gige_camera(library, kind, method):
    """The drawings of one cell are the same whoever delivers them, and so is the result."""
    by_gige = change(course(method, kind, "GigE"), 3)
    straight = change(course(method, kind), 3)
    assert by_gige.code == ""
    assert by_gige.off_mm is not None
    assert by_gige.off_mm == pytest.approx(straight.off_mm, abs=1e-4)
    assert by_gige.off_mm < 0.02


@pytest.mark.soak
@pytest.mark.timeout(900)
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_of_the_camera_ends_each_method_by_name(library, method, fault):
    """Nothing is written, and the tool is lifted."""
    value, code = FAULTS[fault]
    kept = course(method, "EPSON", "GigE")
    with kept.opened(3) as cell:
        source = kept.source(cell, random.Random(3))
        put(cell, **{fault: value, "picture_faults_from": 8})
        before = stored_in(cell)
        with pytest.raises(CalibrationError) as caught:
            run_source(cell, source)
        assert caught.value.code == code
        assert caught.value.remedy
        assert stored_in(cell) == before
        assert cell.tip_z_mm > cell.simulator.world.camera.middle_mm[2] + 8.0
