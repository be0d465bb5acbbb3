"""Cameras whose pictures are late: refused by name in each method, with the tool lifted.

The pictures are numbers: a source tells in the name of each where the simulated camera saw the
tip, and a finder reads it there. All else is as with a real camera.
"""

import json
from collections import deque
from dataclasses import replace

import numpy as np
import pytest

from robolink.errors import CalibrationError, VerifyError
from robolink.eye.candidate import Candidate
from robolink.eye.eye_camera import EyeCamera
from robolink.eye.picture import CameraPicture
from robolink.eye.settings import EyeSettings
from robolink.methods import (
    CameraAffineSource,
    CameraSource,
    RunoutTableParameters,
    RunoutTableSource,
)
from robolink.model import TIP
from tests.contract._camera_cell import camera_station, cell_of, refusal, run_source, stored_in
from tests.contract._sensor_cell import miss_mm
from tests.contract.test_spots_that_stand_still import AfterTheWrite, held_board, soaked
from tests.eye._picture_servers import Time

pytestmark = [pytest.mark.simulator_only, pytest.mark.timeout(120)]

EDGE_PX = 3.6
DETAILS = {"station": "CAM-1", "radius_px": 12.0}


class CellPictures:
    """Implements PictureSource on a simulated cell.

    Args:
        cell: The cell.
        kept_back: How many pictures are kept back: each question is answered with an older one.
        stuck_after: After so many pictures the same one is handed out for ever.
        noise: Whether that one gets new noise.
        refused: Error by the number of the picture from which on it is raised.
    """

    identity, exposure_us = "pictures", None

    def __init__(self, cell, *, kept_back=0, stuck_after=None, noise=False, refused=None):
        self._cell = cell
        self._buffer = deque([self._shot() for _ in range(kept_back)])
        self._stuck_after, self._noise, self._refused = stuck_after, noise, refused
        self._rng = np.random.default_rng(3)
        self.taken, self.closed = 0, 0
        self._last = None

    def expose(self, exposure_us):
        raise AssertionError

    def _shot(self):
        simulator = self._cell.simulator
        with simulator.lock:
            held = simulator.world.parameters.board_held
            marks = range(1 + len(simulator.world.board.drawing_mm)) if held else (TIP,)
            return {mark: simulator.world.spots(mark) for mark in marks}

    def take(self):
        self.taken += 1
        if self._refused and self.taken >= self._refused[0]:
            raise CalibrationError(self._refused[1], "bench", remedy="look at the bench")
        stuck = self._stuck_after is not None and self.taken > self._stuck_after
        if stuck and not self._noise:
            return self._last
        if not stuck:
            self._buffer.append(self._shot())
            self._shown = self._buffer.popleft()
        grey = self._rng.integers(40, 200, (16, 16)).astype(np.uint8)
        self._last = CameraPicture(grey=grey, asked_s=0.0, name=json.dumps(self._shown))
        return self._last

    def close(self):
        self.closed += 1


def told_places(mark, settings):
    """Return a finder that reads where things are in the name of a picture."""

    def find(picture):
        told = json.loads(picture.name).get(str(mark), [])  # none before a board is held
        return [Candidate(x, y, radius or 12.0, 0.9, edge_px=EDGE_PX) for x, y, radius in told]

    return find


def eye(cell, **faults):
    pictures = CellPictures(cell, **faults)
    return EyeCamera(pictures, EyeSettings(), finder_of=told_places, clock=Time())


def board(cell, camera, station):
    return replace(held_board(cell, station), sensor=camera)


METHODS = {
    "camera": lambda cell, camera, station: CameraSource(camera, station),
    "camera-affine": lambda cell, camera, station: CameraAffineSource(
        camera, replace(station, model=None), name="CAM"
    ),
    "runout-table": lambda cell, camera, station: RunoutTableSource(
        camera, station, RunoutTableParameters(turns_deg=tuple(range(0, 360, 45))).look
    ),
    "board": board,
}


def missed_mm(cell):
    found = stored_in(cell)
    assert found is not None
    return miss_mm(found, cell.truth)


def station_of(cell):
    return replace(camera_station(cell), details=DETAILS)


def source_with(method, cell, camera):
    return METHODS[method](cell, camera, station_of(cell))


def cases(*each_time):
    """Return method and kind of robot as parameters; those not tried each time are for soak."""
    return [
        pytest.param(method, kind, marks=() if (method, kind) in each_time else pytest.mark.soak)
        for method in METHODS
        for kind in ("epson", "softmotion")
    ]


@pytest.mark.parametrize(("method", "kind"), cases(("camera", "epson"), ("board", "softmotion")))
def test_a_camera_of_fresh_pictures_measures_as_any_other(method, kind):
    with cell_of(kind) as cell:
        camera = eye(cell)
        report = run_source(cell, source_with(method, cell, camera))
        assert "focus_not_taught" in report.proposal.result.warnings
        if method != "board":
            assert missed_mm(cell) < 0.02


@pytest.mark.parametrize("kept_back", [pytest.param(1, marks=pytest.mark.soak), 2])
@pytest.mark.parametrize(("method", "kind"), cases(("camera", "epson")))
def test_few_pictures_that_are_kept_back_are_waited_for(method, kind, kept_back):
    with cell_of(kind) as cell:
        run_source(cell, source_with(method, cell, eye(cell, kept_back=kept_back)))
        assert method == "board" or missed_mm(cell) < 0.02


@pytest.mark.parametrize(
    "kept_back", [3, *(pytest.param(n, marks=pytest.mark.soak) for n in (5, 7, 9))]
)
@pytest.mark.parametrize(("method", "kind"), cases(("camera", "epson"), ("camera-affine", "epson")))
def test_pictures_that_are_kept_back_are_stale(method, kind, kept_back):
    with cell_of(kind) as cell:
        camera = eye(cell, kept_back=kept_back)
        error = refusal(cell, source_with(method, cell, camera))
        assert error.code == "stale_picture"


def test_and_what_was_learnt_of_it_makes_them_good():
    with cell_of("epson") as cell:
        camera = eye(cell, kept_back=4)
        station = replace(camera_station(cell), details={**DETAILS, "lag_pictures": 4})
        run_source(cell, CameraSource(camera, station))
        assert missed_mm(cell) < 0.02


@pytest.mark.parametrize("noise", [False, True])
@pytest.mark.parametrize("stuck_after", [10, pytest.param(14, marks=pytest.mark.soak)])
@pytest.mark.parametrize(("method", "kind"), cases(("camera", "epson")))
def test_a_picture_that_stands_still_is_no_look(method, kind, stuck_after, noise):
    with cell_of(kind) as cell:
        camera = eye(cell, stuck_after=stuck_after, noise=noise)
        error = refusal(cell, source_with(method, cell, camera))
        # With new noise it looks like a fleck: nothing tells the two apart.
        assert error.code == ("tip_did_not_move" if noise else "stale_picture")


@pytest.mark.parametrize("method", soaked("camera"))
def test_nor_in_the_turn_test_and_the_old_value_comes_back(method):
    with cell_of("epson") as cell:
        camera = eye(cell)
        pictures = camera.source

        class Later(AfterTheWrite):
            def wrote(self, receipt):
                pictures._buffer.extend([pictures._shot()] * 4)

        source = source_with(method, cell, camera)
        error = refusal(cell, source, error=VerifyError, listener=Later(cell, {}))
        assert error.code == "stale_picture"
        assert cell.simulator.machine.flash_writes == 2


@pytest.mark.parametrize(
    ("code", "at"), [("camera_gone", 1), ("packets_lost", 2), ("picture_late", 9)]
)
def test_a_camera_that_fails_keeps_the_name_of_its_failure(code, at):
    with cell_of("epson") as cell:
        camera = eye(cell, refused=(at, code))
        error = refusal_anywhere(cell, CameraSource(camera, station_of(cell)))
        assert error.code == code
        assert camera.source.closed == 0  # it belongs to whoever opened it


def refusal_anywhere(cell, source):
    before = stored_in(cell)
    with pytest.raises(CalibrationError) as raised:
        run_source(cell, source)
    assert stored_in(cell) == before
    return raised.value
