"""A nozzle change by an own eye over HTTP: from the address of a camera to what is on record."""

import json
from dataclasses import replace

import pytest
from robolink_simulators.pictures.camera import DrawnCamera
from robolink_simulators.pictures.server import PictureServer

from robolink.eye.kept_pictures import LookRole, kept_pictures
from robolink.methods import CameraSource
from robolink.model import json_value
from tests.contract._camera_cell import KINDS, camera_station, cell_of, run_source, stored_in
from tests.contract._sensor_cell import miss_mm

pytestmark = [pytest.mark.simulator_only, pytest.mark.timeout(120), pytest.mark.soak]

SECRET = "correct-horse-battery"


@pytest.mark.parametrize("kind", KINDS)
def test_a_change_over_http_is_right_and_tells_no_password(kind, tmp_path, monkeypatch):
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path))
    with cell_of(kind) as cell, PictureServer(DrawnCamera(cell.simulator)) as server:
        station = camera_station(cell)
        details = {"station": "CAM-1", "diameter_mm": 1.0, "edge_px": 2.4}
        url = server.url("png").replace("http://", f"http://me:{SECRET}@")
        report = run_source(cell, CameraSource(url, replace(station, details=details)))
        found = stored_in(cell)
        assert found is not None
        assert miss_mm(found, cell.truth) < 0.01
        assert report.proposal.result.warnings == ()
        with cell.connected() as controller:
            entries = list(controller.outcomes.recorded())
        assert SECRET not in json.dumps([json_value(entry) for entry in entries], default=str)
        kept = kept_pictures(station="CAM-1")
        assert {one.look.role for one in kept} >= {LookRole.FIRST}
        assert SECRET not in "".join(path.name for path in tmp_path.rglob("*"))
        for path in (tmp_path / "pictures").glob("*.json"):
            assert SECRET not in path.read_text()
