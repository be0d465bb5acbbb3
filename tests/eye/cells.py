"""Nozzle changes by an own eye on the drawn pictures of a simulated cell, truth known.

Driver, procedures, camera and finder are the real ones. The robot's time is virtual; pictures come
straight from the simulator, over HTTP, or as a GigE camera of Aravis on loopback.
"""

import math
import random
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from functools import partial
from typing import Any, Final

from robolink_simulators.pictures.camera import DrawnCamera
from robolink_simulators.pictures.server import PictureServer
from robolink_simulators.pictures.source import DrawnPictures

from robolink.calibration import BoardDrawing
from robolink.errors import CalibrationError
from robolink.eye.cameras.gige.opening import open_gige
from robolink.eye.candidate import TipShape
from robolink.eye.eye_camera import EyeCamera
from robolink.eye.opening import open_source
from robolink.eye.tip_finder import find_tips
from robolink.methods import (
    AllRoundPlan,
    BoardSource,
    CameraAffineSource,
    CameraSource,
    RunoutTableSource,
)
from tests.certificate.live import Course, held_board
from tests.contract._camera_cell import camera_station, furnish
from tests.contract._sensor_cell import plc_sensor_cell, sensor_cell
from tests.eye.gige.conftest import alone
from tests.unit._drawn_cells import cell_before_camera

KINDS: Final = {"EPSON": sensor_cell, "PLC": plc_sensor_cell}
METHODS: Final = ("camera", "camera-affine", "board", "runout-table")

SIZE_PX: Final = (640, 512)

GIGE_ADDRESS: Final = "127.0.0.1"
PORT_PATIENCE_S: Final = 3600.0
PICTURE_PATIENCE_S: Final = 30.0


@contextmanager
def straight(cell: Any) -> Iterator[Callable[[], Any]]:
    """Take pictures from the simulator itself, in its time."""
    camera = DrawnCamera(cell.simulator)
    yield lambda: DrawnPictures(camera, clock=cell.clock)


@contextmanager
def over_http(cell: Any, ending: str = "pgm") -> Iterator[Callable[[], Any]]:
    """Serve them over HTTP on loopback."""
    with PictureServer(DrawnCamera(cell.simulator)) as server:
        yield lambda: open_source(server.url(ending))


@contextmanager
def over_gige(cell: Any) -> Iterator[Callable[[], Any]]:
    """Serve them as a GigE camera on loopback, by the library Aravis.

    Its port cannot be chosen: who comes second waits until the first has changed its nozzle. The
    time of the camera is real, and on a busy computer a picture is drawn for seconds.
    """
    from robolink_simulators.pictures.gige_camera import drawn_gige_camera

    drawn = DrawnCamera(cell.simulator)
    with alone(PORT_PATIENCE_S), drawn_gige_camera(drawn, GIGE_ADDRESS):
        yield lambda: open_gige(GIGE_ADDRESS, patience_s=PICTURE_PATIENCE_S)


WAYS: Final[Mapping[str, Callable[..., Any]]] = {
    "straight": straight,
    "HTTP": over_http,
    "JPEG": partial(over_http, ending="jpg"),
    "GigE": over_gige,
}


def taught(kind: str, seed: int, world: Mapping[str, Any]) -> dict[str, object]:
    """Return what is stated and taught of the camera's station: by a tip in focus before it.

    Args:
        kind: The kind of controller.
        seed: Of the cell.
        world: Parameters of its world.

    Raises:
        CalibrationError: ``tip_not_seen``: not exactly one tip is found, so nobody can teach it.
    """
    before = {"EPSON": "epson", "PLC": "softmotion"}[kind]
    simulator = cell_before_camera(before, seed, **{**world, "board_held": False})
    parameters, camera = simulator.world.parameters, simulator.world.camera
    camera.optics = replace(camera.optics, size_px=SIZE_PX)
    um_per_px = math.sqrt(parameters.camera_um_per_px_x * parameters.camera_um_per_px_y)
    stated_px = parameters.tip_diameter_mm / 2 * 1000 / um_per_px
    shape = TipShape(stated_px, bore=bool(parameters.tip_bore_mm))
    found = [one for one in find_tips(DrawnCamera(simulator).grey(), shape) if one.accepted]
    if len(found) != 1:
        raise CalibrationError("tip_not_seen", f"{len(found)} tips", remedy="change the light")
    (tip,) = found
    return {
        "station": "CAM-01",
        "diameter_mm": parameters.tip_diameter_mm,
        "radius_px": tip.radius_px,
        "bore": shape.bore,
        "bore_ratio": tip.bore_ratio,
        "edge_px": tip.edge_px,
        "marks": parameters.board_mark,
        "mark_mm": parameters.board_mark_mm,
    }


def fault(cell: Any, **parameters: Any) -> None:
    """Change parameters of the world; its pictures stay small, which saves three quarters."""
    furnish(cell, **parameters)
    camera = cell.simulator.world.camera
    camera.optics = replace(camera.optics, size_px=SIZE_PX)


@contextmanager
def opened(kind: str, way: str, world: Mapping[str, Any], seed: int) -> Iterator[Any]:
    """Set up a cell with an own eye; what is taught of its station is that of the clean cell.

    Args:
        kind: The kind of controller.
        way: How pictures come.
        world: Parameters of the world, other than its faults.
        seed: Of everything in it.
    """
    with ExitStack() as stack:
        cell: Any = stack.enter_context(KINDS[kind](seed))
        fault(cell, **world)
        cell.details = taught(kind, seed, world)
        source = stack.enter_context(WAYS[way](cell))
        cell.eye = lambda: EyeCamera(source(), clock=cell.clock)
        yield cell


def station(cell: Any, *, known: bool = True) -> Any:
    """Return the true station of the camera, with what is taught of it."""
    details = dict(cell.details)
    return replace(camera_station(cell, known=known), details=details)


class OpenedAnew:
    """A camera that is opened with each use of it, as one that is named by a URL.

    Args:
        cell: Whose.
    """

    def __init__(self, cell: Any) -> None:
        self._cell = cell
        self._open: Any = None

    def __getattr__(self, name: str) -> Any:
        if self._open is None:
            self._open = self._cell.eye()
        return getattr(self._open, name)

    def at_station(self, details: Any, mm_per_px: float | None) -> Any:
        """Return it for a station; Python 3.12 sees no protocol in ``__getattr__``."""
        return self.__getattr__("at_station")(details, mm_per_px)

    def close(self) -> None:
        """Release it."""
        if self._open is not None:
            self._open.close()
            self._open = None


def camera(cell: Any, _rng: random.Random) -> Any:
    """A calibrated camera, at four angles."""
    return CameraSource(OpenedAnew(cell), station(cell))


def camera_affine(cell: Any, _rng: random.Random) -> Any:
    """A camera without a calibration."""
    return CameraAffineSource(OpenedAnew(cell), station(cell, known=False))


def runout_table(cell: Any, _rng: random.Random) -> Any:
    """A calibrated camera, all round."""
    turns = tuple(45.0 * step for step in range(8))
    return RunoutTableSource(OpenedAnew(cell), station(cell), AllRoundPlan(turns_deg=turns))


def board(cell: Any, _rng: random.Random) -> Any:
    """A held board with two fiducials."""
    drawing = BoardDrawing(cell.simulator.world.board.drawing_mm[:2])
    return BoardSource(OpenedAnew(cell), station(cell), drawing)


_SOURCES: Final[Mapping[str, Callable[[Any, random.Random], Any]]] = {
    "camera": camera,
    "camera-affine": camera_affine,
    "runout-table": runout_table,
    "board": board,
}


def course(method: str, kind: str, way: str = "straight", **world: Any) -> Course:
    """Return a method with an own eye, on a kind of controller.

    Args:
        method: One of :data:`METHODS`.
        kind: The kind of controller.
        way: How pictures come: one of :data:`WAYS`.
        world: Parameters of the world, other than its faults.
    """
    held = {"board_held": True} if method == "board" else {}
    made = Course(
        f"{method} by {way}",
        kind,
        partial(opened, kind, way, {**held, **world}),
        _SOURCES[method],
        ("tip_image_px",),
    )
    return replace(made, truth=held_board) if method == "board" else made
