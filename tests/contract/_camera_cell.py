"""A simulated cell with an up-looking camera, and what is known about that camera."""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import replace
from typing import Any, Final

from robolink.calibration import CameraModel, CameraStation
from robolink.controllers.softmotion import SoftMotionController
from robolink.model import ToolOffset
from tests.contract._sensor_cell import TOOL, SensorCell, plc_sensor_cell, sensor_cell

KINDS: Final[dict[str, Callable[[int], AbstractContextManager[SensorCell]]]] = {
    "epson": sensor_cell,
    "softmotion": plc_sensor_cell,
}


def camera_model(cell: SensorCell) -> CameraModel:
    """Return the true map of the pixels, for a lens that does not lean."""
    camera = cell.simulator.world.camera
    width, height = camera.optics.size_px
    (a, b), (c, d) = camera.optics.mm_per_px
    x_mm, y_mm, _ = camera.middle_mm
    origin = (x_mm - (a * width + b * height) / 2, y_mm - (c * width + d * height) / 2)
    return CameraModel(((a, b), (c, d)), origin)


def camera_station(cell: SensorCell, *, known: bool = True) -> CameraStation:
    """Return where the camera is."""
    x_mm, y_mm, z_mm = cell.simulator.world.camera.middle_mm
    return CameraStation(x_mm, y_mm, z_mm, camera_model(cell) if known else None)


def furnish(cell: SensorCell, **parameters: Any) -> None:
    """Change what goes wrong in the cell."""
    world = cell.simulator.world
    world.set_up(replace(world.parameters, **parameters))


def run_source(cell: SensorCell, source: Any, *, write: bool = True, **gate: Any) -> Any:
    """Change the nozzle of either kind of controller, and return the report about the tool."""
    with cell.connected() as controller:
        if isinstance(controller, SoftMotionController):
            controller.take()
        return cell.change(source, **gate)(controller, write=write)


def stored_in(cell: SensorCell) -> ToolOffset | None:
    """Read what the controller holds."""
    with cell.connected() as controller:
        return controller.tools.read(TOOL)


@contextmanager
def cell_of(kind: str, seed: int = 3) -> Iterator[SensorCell]:
    """Set a cell up around a controller of one kind."""
    with KINDS[kind](seed) as cell:
        yield cell
