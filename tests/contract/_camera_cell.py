"""A simulated cell with an up-looking camera, and the true data of that camera."""

import re
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import pytest

from robolink.calibration import CameraModel
from robolink.calibration_run import Listener
from robolink.controllers import SoftMotionController
from robolink.errors import CalibrationError, RobolinkError
from robolink.model import ToolOffset
from robolink.stations import CameraStation
from tests.contract._sensor_cell import TOOL, SensorCell, plc_sensor_cell, sensor_cell

KINDS: Final[dict[str, Callable[[int], AbstractContextManager[SensorCell]]]] = {
    "epson": sensor_cell,
    "softmotion": plc_sensor_cell,
}


def camera_model(cell: SensorCell) -> CameraModel:
    """Return the true pixel calibration, for a lens that does not lean."""
    camera = cell.simulator.world.camera
    width, height = camera.optics.size_px
    (a, b), (c, d) = camera.optics.mm_per_px
    x_mm, y_mm, _ = camera.middle_mm
    origin = (x_mm - (a * width + b * height) / 2, y_mm - (c * width + d * height) / 2)
    return CameraModel(((a, b), (c, d)), origin)


def camera_station(cell: SensorCell, *, known: bool = True) -> CameraStation:
    """Return the true station of the camera."""
    x_mm, y_mm, z_mm = cell.simulator.world.camera.middle_mm
    return CameraStation(x_mm, y_mm, z_mm, camera_model(cell) if known else None)


def recipe_here(cell: SensorCell, example: Path, folder: Path) -> Path:
    """Return a recipe written for the simulated EPSON cell, with the numbers of this cell."""
    station, model = camera_station(cell), camera_model(cell)
    flange = cell.simulator.world.robot.flange()
    safe = f"x_mm = {flange.x_mm}, y_mm = {flange.y_mm}, z_mm = {flange.z_mm}, u_deg = {{u}}"
    text = example.read_text()
    for old, new in (
        (r"mm_per_px = .*", f"mm_per_px = {[list(row) for row in model.mm_per_px]}"),
        (r"origin_mm = \[.*?\]", f"origin_mm = {list(model.origin_mm)}"),
        (r"\nx_mm = .*", f"\nx_mm = {station.x_mm}"),
        (r"\ny_mm = .*", f"\ny_mm = {station.y_mm}"),
        (r"\nz_mm = .*", f"\nz_mm = {station.z_mm}"),
        (r"safe = {.*", f"safe = {{ {safe.format(u=flange.u_deg)} }}"),
        (r"\napproach = .*", ""),
    ):
        text = re.sub(old, new, text)
    path = folder / example.name
    path.write_text(text)
    return path


def furnish(cell: SensorCell, **parameters: Any) -> None:
    """Change the simulated errors of the cell."""
    world = cell.simulator.world
    world.set_up(replace(world.parameters, **parameters))


def run_source(cell: SensorCell, source: Any, *, write: bool = True, **gate: Any) -> Any:
    """Change a nozzle on either kind of controller and return the tool's report."""
    with cell.connected() as controller:
        if isinstance(controller, SoftMotionController):
            controller.take()
        return cell.change(source, **gate)(controller, write=write)


def stored_in(cell: SensorCell) -> ToolOffset | None:
    """Read the offset that the controller stores."""
    with cell.connected() as controller:
        return controller.tools.read(TOOL)


@contextmanager
def cell_of(kind: str, seed: int = 3) -> Iterator[SensorCell]:
    """Set up a cell around a controller of one kind."""
    with KINDS[kind](seed) as cell:
        yield cell


def refusal(
    cell: SensorCell,
    source: Any,
    *,
    error: type[RobolinkError] = CalibrationError,
    listener: Listener | None = None,
) -> Any:
    """Check that a change is refused: old value, tool lifted, and a way on."""
    before = stored_in(cell)
    with pytest.raises(error) as raised:
        if listener is None:
            run_source(cell, source)
        else:
            with cell.connected() as controller:
                if hasattr(controller, "take"):
                    controller.take()
                cell.change(source, listener)(controller)
    after = stored_in(cell)
    assert before is not None
    assert after is not None
    assert after.rounded(3) == before.rounded(3)
    assert cell.tip_z_mm > cell.simulator.world.camera.middle_mm[2] + 8.0
    assert raised.value.remedy
    return raised.value
