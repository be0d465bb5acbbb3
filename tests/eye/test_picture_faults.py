"""What goes wrong with pictures ends each method by its own name, with nothing written."""

from dataclasses import replace
from typing import Any, Final

import pytest
from robolink_simulators.pictures.camera import DrawnCamera
from robolink_simulators.pictures.source import DrawnPictures

from robolink.eye.eye_camera import EyeCamera
from tests.certificate.live import Course, Ended, change
from tests.eye.cells import METHODS, camera, course, fault
from tests.eye.picture_faults import CODES, fault_of

SEED = 5
LIFTED_MM = 1.5
"""By how much at least a tool that is lifted is above the plane of focus."""

LATE_S: Final = 0.8
FRAME_S: Final = 0.05
"""How late a stream is, and how long from one of its frames to the next."""


def ended(method: str, kind: str, name: str, *, from_write: bool = False) -> tuple[Ended, Any]:
    """Change a nozzle while something is wrong with the pictures; give its end and its cell.

    That the controller holds the old value afterwards is checked by :func:`change` itself.
    """
    cells = list[Any]()

    def put_in(cell: Any) -> None:
        cells.append(cell)
        held = {"board_held": True} if method == "board" else {}
        fault(cell, **{**held, **fault_of(name, method)})

    when: dict[str, Any] = {"at_write": put_in} if from_write else {"wrong": put_in}
    end = change(course(method, kind), SEED, **when)
    return end, cells[-1]


def is_lifted(cell: Any) -> bool:
    """Return whether the tip is off the plane of focus."""
    world = cell.simulator.world
    above_mm: float = world.tip_mm()[2] - world.camera.middle_mm[2]
    return above_mm > LIFTED_MM


def require_refused(method: str, kind: str, name: str) -> None:
    end, cell = ended(method, kind, name)
    assert end.code in CODES[name].of(method), end
    assert not end.taken_back, "it was written"
    assert end.proposal is None
    assert is_lifted(cell)


def soak(method: str, kind: str = "EPSON") -> Any:
    return pytest.param(method, kind, marks=pytest.mark.soak)


def each(*quick: str) -> Any:
    """Return all methods on both kinds; those that are not quick are left to soak."""
    return pytest.mark.parametrize(
        ("method", "kind"),
        [
            (method, kind) if kind == "EPSON" and method in quick else soak(method, kind)
            for method in METHODS
            for kind in ("EPSON", "PLC")
        ],
    )


@pytest.mark.fault("F81")
@pytest.mark.timeout(300)
@each()
def test_f81_a_fleck_beside_the_tip_is_one_too_many(method, kind):
    require_refused(method, kind, "fleck")


@pytest.mark.fault("F81")
@pytest.mark.timeout(300)
@each()
def test_f81_a_fleck_in_place_of_the_tip_stands_still(method, kind):
    require_refused(method, kind, "fleck in place of the tip")


@pytest.mark.fault("F82")
@pytest.mark.timeout(300)
@each()
def test_f82_a_ring_of_lamps_is_no_tip(method, kind):
    require_refused(method, kind, "lamp ring")


@pytest.mark.fault("F83")
@pytest.mark.timeout(300)
@each("camera-affine")
def test_f83_a_picture_that_is_stuck_is_told(method, kind):
    require_refused(method, kind, "stuck picture")


@pytest.mark.fault("F83")
@pytest.mark.timeout(300)
@each()
def test_f83_a_picture_that_is_stuck_with_new_noise_shows_nothing_that_moves(method, kind):
    require_refused(method, kind, "stuck picture, new noise")


@pytest.mark.fault("F84")
@pytest.mark.timeout(300)
@each()
def test_f84_a_stream_that_is_late_is_told(method, kind):
    require_refused(method, kind, "late stream")


@pytest.mark.fault("F84")
@pytest.mark.timeout(300)
@each()
def test_f84_a_source_that_keeps_pictures_back_is_told(method, kind):
    require_refused(method, kind, "late by three pictures")


@pytest.mark.fault("F85")
@pytest.mark.timeout(300)
@each()
def test_f85_a_tip_that_the_edge_of_the_picture_cuts_is_told(method, kind):
    require_refused(method, kind, "cut")


@pytest.mark.fault("F86")
@pytest.mark.timeout(300)
@each("runout-table")
def test_f86_a_second_nozzle_is_one_too_many(method, kind):
    require_refused(method, kind, "second nozzle")


@pytest.mark.fault("F87")
@pytest.mark.timeout(300)
@each()
def test_f87_what_is_out_of_focus_is_told(method, kind):
    require_refused(method, kind, "1 mm out of focus")


def late_stream(taught_s: float) -> Course:
    """Return a nozzle change by a stream that goes on while the robot waits, its delay taught."""

    def source(cell: Any, rng: Any) -> Any:
        drawn, advance = DrawnCamera(cell.simulator), cell.clock.advance

        def frame_by_frame(seconds: float) -> None:
            while seconds > 0:
                advance(min(FRAME_S, seconds))
                drawn.note()
                seconds -= FRAME_S

        cell.clock.advance = frame_by_frame
        cell.eye = lambda: EyeCamera(DrawnPictures(drawn, clock=cell.clock), clock=cell.clock)
        cell.details = {**cell.details, "lag_s": taught_s}
        return camera(cell, rng)

    return replace(course("camera", "EPSON"), source=source)


@pytest.mark.soak
@pytest.mark.fault("F84")
@pytest.mark.timeout(300)
def test_f84_a_delay_that_was_taught_is_waited_for_and_one_that_was_not_is_refused():
    def late(cell: Any) -> None:
        fault(cell, picture_late_s=LATE_S)

    taught = change(late_stream(LATE_S + FRAME_S), SEED, wrong=late)
    assert taught.good
    assert taught.share < 0.8
    untaught = change(late_stream(0.0), SEED, wrong=late)
    assert untaught.code == "stale_picture"
    assert untaught.proposal is None


@pytest.mark.soak
@pytest.mark.timeout(300)
@pytest.mark.parametrize("name", CODES)
@pytest.mark.parametrize("method", METHODS)
def test_what_begins_in_the_turn_test_brings_the_old_value_back(method, name):
    """The value was written; :func:`change` has seen that the old one is there again."""
    end, cell = ended(method, "EPSON", name, from_write=True)
    assert end.code, "it stays"
    assert end.proposal is not None, "it was refused before the write"
    assert end.proof is None or not end.proof.passed
    assert is_lifted(cell)


@pytest.mark.soak
@pytest.mark.timeout(300)
@pytest.mark.parametrize("kind", ["EPSON", "PLC"])
@pytest.mark.parametrize("mark", ["round", "cross", "aruco"])
def test_a_board_is_measured_by_its_fiducials(mark, kind):
    end = change(course("board", kind, board_mark=mark), 1)
    assert end.good
    assert end.share < 0.8


@pytest.mark.soak
@pytest.mark.timeout(300)
@pytest.mark.parametrize("kind", ["EPSON", "PLC"])
@pytest.mark.parametrize("method", METHODS)
def test_without_a_fault_each_method_holds_the_truth(method, kind):
    end = change(course(method, kind), SEED)
    assert end.good
    assert end.share < 0.8
