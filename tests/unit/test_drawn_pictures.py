"""Pictures of the up-looking camera, drawn from the truth of a simulated cell."""

import math
from dataclasses import replace

import numpy as np
import pytest
from robolink_simulators.cell.picture_settings import NO_FAULTS, PictureLook
from robolink_simulators.cell.tip_looks import TipBuild, look_drawn
from robolink_simulators.cell.world_parameters import WorldParameters, parameters_from_text
from robolink_simulators.pictures.camera import DrawnCamera
from robolink_simulators.pictures.drawing import Pencil
from robolink_simulators.pictures.scene import DrawnScene, Placed, SeenTip
from robolink_simulators.pictures.shading import disc

from robolink.errors import ConfigError
from tests._rows import each_row
from tests.unit._drawn_cells import (
    KINDS,
    PLAIN,
    RADIUS_PX,
    bring_to,
    cell_before_camera,
    edge_points,
    edge_width_px,
    fitted_circle,
    nearest_pixel,
    place_px,
    turn_to,
)


@pytest.fixture(params=KINDS)
def kind(request):
    return request.param


def picture_of(simulator):
    return DrawnCamera(simulator).grey()


def supersampled_disc(x, y, radius, sigma, size):
    """Return a disc as light would make it: fine points, blurred, summed over each pixel."""
    fine = 16
    at = (np.arange(size * fine) + 0.5) / fine
    hard = (np.hypot(at[None, :] - x, at[:, None] - y) < radius).astype(float)
    reach = np.arange(-int(5 * sigma * fine), int(5 * sigma * fine) + 1) / fine
    kernel = np.exp(-(reach**2) / (2 * sigma**2))
    kernel /= kernel.sum()
    for axis in (0, 1):
        hard = np.apply_along_axis(lambda line: np.convolve(line, kernel, "same"), axis, hard)
    return hard.reshape(size, fine, size, fine).mean(axis=(1, 3))


@pytest.mark.parametrize(("x", "y"), [(20.0, 20.0), (20.37, 19.81)])
def test_a_soft_disc_is_what_finer_points_would_make_of_it(x, y):
    size, radius, sigma = 40, 9.0, 1.1
    fine = supersampled_disc(x, y, radius, sigma, size)
    at = np.arange(size) + 0.5
    out = np.hypot(at[None, :] - x, at[:, None] - y).astype(np.float32)
    drawn = disc(out, radius, math.sqrt(sigma**2 + 1 / 12)).astype(float)
    assert np.abs(drawn - fine).max() < 0.02
    assert drawn.sum() == pytest.approx(fine.sum(), rel=0.002)
    for picture in (drawn, fine):
        centre = (picture.sum(0) @ at / picture.sum(), picture.sum(1) @ at / picture.sum())
        assert centre == pytest.approx((x, y), abs=0.005)


@pytest.mark.parametrize("at_px", [(640.0, 512.0), (611.37, 498.82)])
def test_the_face_is_drawn_where_the_truth_says(at_px):
    look = replace(
        look_drawn(TipBuild(bore_mm=0.2), "a"), edge=(0.0,) * 24, texture=0.0, cone=0.0, face=250.0
    )
    placed = Placed(at_px, ((50.0, 0.0), (0.0, 50.0)), 0.0)
    pencil = Pencil(1, PictureLook(noise_grey=0.0, clutter=0, glare=0.0))
    grey = pencil.draw(DrawnScene((1280, 1024), 20.0, (SeenTip(placed, look, ()),)), NO_FAULTS, 1)
    middle = (round(at_px[0]), round(at_px[1]))
    points = edge_points(grey, middle, RADIUS_PX)
    x, y, radius = fitted_circle(points)
    assert middle[0] + x + 0.5 == pytest.approx(at_px[0], abs=0.01)
    assert middle[1] + y + 0.5 == pytest.approx(at_px[1], abs=0.01)
    assert radius == pytest.approx(RADIUS_PX, abs=0.1)


@pytest.mark.parametrize("tilt_deg", [0.0, 4.0])
def test_a_tip_is_seen_where_the_perfect_finder_sees_it(kind, tilt_deg):
    simulator = cell_before_camera(kind, camera_tilt_deg=tilt_deg, **PLAIN)
    for beside_mm in ((0.0, 0.0, 0.0), (3.2, -2.1, 0.4)):
        bring_to(simulator, beside_mm)
        ((x, y),) = simulator.world.see()
        assert place_px(simulator) == pytest.approx((x - 0.5, y - 0.5))
        middle = (round(x), round(y))
        points = edge_points(picture_of(simulator), middle, RADIUS_PX)
        found_x, found_y, _ = fitted_circle(points)
        found = (middle[0] + found_x, middle[1] + found_y)
        assert found == pytest.approx(place_px(simulator), abs=0.08)


def test_what_moves_in_the_cell_moves_in_the_picture_by_the_scale(kind):
    simulator = cell_before_camera(kind, camera_um_per_px_x=25.0, camera_um_per_px_y=25.0, **PLAIN)
    middles = []
    for beside_mm in ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)):
        bring_to(simulator, beside_mm)
        at = nearest_pixel(simulator)
        x, y, _ = fitted_circle(edge_points(picture_of(simulator), at, 20.0))
        middles.append((at[0] + x, at[1] + y))
    (x, y), (to_x, to_y) = middles
    (a, b), (c, d) = simulator.world.camera.optics.mm_per_px
    assert a * (to_x - x) + b * (to_y - y) == pytest.approx(1.0, abs=0.001)
    assert c * (to_x - x) + d * (to_y - y) == pytest.approx(0.0, abs=0.001)


def cut_out(grey, half=40):
    """Return the middle of a picture, whose middle lies between pixels."""
    return grey[512 - half : 512 + half, 640 - half : 640 + half].astype(float)


def alike(first, second):
    first, second = first - first.mean(), second - second.mean()
    return float((first * second).sum() / math.sqrt((first**2).sum() * (second**2).sum()))


@each_row("mirrored", [True, False])
@each_row("tip", [{"tip_kind": "rough"}, {"tip_dirt": 4}, {"tip_kind": "needle"}])
def test_what_belongs_to_the_tool_turns_with_it(tip, mirrored):
    simulator = cell_before_camera(camera_mirrored=mirrored, **tip, **PLAIN)
    before = cut_out(picture_of(simulator))
    turn_to(simulator, 90.0)
    after = cut_out(picture_of(simulator))
    # np.rot90 turns from right to up; a mirrored picture shows the base as seen from above.
    turned = np.rot90(before, 1 if mirrored else -1)
    wrong = np.rot90(before, -1 if mirrored else 1)
    assert alike(after, turned) > 0.97
    assert alike(after, turned) - alike(after, wrong) > 0.02
    # Ring and bore look alike from all sides, so what is left of them tells.
    ring = (before + np.rot90(before) + np.rot90(before, 2) + np.rot90(before, 3)) / 4
    assert alike(after - ring, turned - ring) > 0.6
    assert alike(after - ring, wrong - ring) < 0.3


def test_the_lamp_stands_still_when_the_tool_turns():
    simulator = cell_before_camera(**{**PLAIN, "picture_glare": 0.3})
    before = cut_out(picture_of(simulator), 30)
    turn_to(simulator, 90.0)
    after = cut_out(picture_of(simulator), 30)
    ring = (before + np.rot90(before) + np.rot90(before, 2) + np.rot90(before, 3)) / 4
    assert alike(after - ring, before - ring) > 0.8


def test_a_rough_edge_puts_the_tip_beside_itself_as_the_truth_tells():
    """No residual shows this error, so a fair count of coverage has to know it."""
    simulator = cell_before_camera(
        tip_kind="rough", tip_diameter_mm=2.0, camera_turn_deg=0.0, camera_mirrored=False, **PLAIN
    )
    beside_mm = simulator.truth()["looks"]["1"]["seen_beside_mm"]
    assert 0.002 < math.hypot(*beside_mm) < 0.05
    found = []
    for _ in range(2):
        at = nearest_pixel(simulator)
        x, y, _ = fitted_circle(edge_points(picture_of(simulator), at, 2 * RADIUS_PX))
        found.append((at[0] + x, at[1] + y))
        turn_to(simulator, 180.0)
    half_px = [(a - b) / 2 for a, b in zip(*found, strict=True)]
    turn_to(simulator, 0.0)
    world = simulator.world
    x_axis = world.axis("x")
    ex, ey = x_axis[:2]
    true_mm = (ex * beside_mm[0] - ey * beside_mm[1], ey * beside_mm[0] + ex * beside_mm[1])
    assert [it * 0.02 for it in half_px] == pytest.approx(true_mm, abs=0.004)


def test_a_bore_off_the_middle_turns_too():
    simulator = cell_before_camera(tip_bore_aside_mm=0.1, **PLAIN)
    shifts = []
    for _ in range(2):
        dark = cut_out(picture_of(simulator), 22) < 90
        rows, columns = np.nonzero(dark & (np.hypot(*np.mgrid[-21.5:22, -21.5:22]) < 20))
        shifts.append((columns.mean() - 21.5, rows.mean() - 21.5))
        turn_to(simulator, 180.0)
    (x, y), (turned_x, turned_y) = shifts
    assert math.hypot(x, y) == pytest.approx(5.0, abs=0.4)
    assert (turned_x, turned_y) == pytest.approx((-x, -y), abs=0.3)


def test_an_edge_is_as_blurred_as_it_is_out_of_focus():
    sharp, *others = (
        edge_width_px(picture_of(simulator), place_px(simulator), RADIUS_PX)
        for simulator in (
            cell_before_camera(**PLAIN),
            cell_before_camera(above_mm=0.5, **PLAIN),
            cell_before_camera(above_mm=1.0, **PLAIN),
            cell_before_camera(above_mm=-1.0, **PLAIN),
            cell_before_camera(picture_defocus_mm=1.0, **PLAIN),
            cell_before_camera(above_mm=-0.5, picture_defocus_mm=0.5, **PLAIN),
        )
    )
    half, above, below, defocused, both = others
    assert 1.5 < sharp < 2.5
    assert 1.3 < half / sharp < 2.0
    assert 2.2 < above / sharp < 3.1
    assert below / above == pytest.approx(1.0, abs=0.1)
    assert defocused / above == pytest.approx(1.0, abs=0.1)
    assert both / above == pytest.approx(1.0, abs=0.1)


def test_a_higher_tip_is_smaller():
    radii = []
    for above_mm in (0.0, 2.0):
        simulator = cell_before_camera(above_mm=above_mm, picture_aperture_mm=0.0, **PLAIN)
        at = nearest_pixel(simulator)
        *_, radius = fitted_circle(edge_points(picture_of(simulator), at, RADIUS_PX))
        radii.append(radius)
    assert radii[1] / radii[0] == pytest.approx(120 / 122, abs=0.003)


def test_the_same_seed_draws_the_same_pictures_and_each_has_its_noise():
    first, again, other = (DrawnCamera(cell_before_camera(seed=seed)) for seed in (3, 3, 4))
    one, two = first.grey(), first.grey()
    assert np.array_equal(one, again.grey())
    assert not np.array_equal(one, two)
    assert np.abs(one.astype(int) - two).mean() == pytest.approx(2 * 2 / math.sqrt(math.pi), 0.1)
    assert np.abs(one.astype(int) - other.grey()).mean() > 4


def test_another_nozzle_looks_different():
    simulator = cell_before_camera(tip_kind="rough", **PLAIN)
    before = simulator.world.look_of()
    simulator.world.change_nozzle()
    after = simulator.world.look_of()
    assert after.edge != before.edge
    assert after.texture_seed != before.texture_seed
    assert after.radius_mm == before.radius_mm


def test_a_second_nozzle_is_in_the_picture_and_for_the_perfect_finder():
    alone, beside = (cell_before_camera(second_tip_beside_mm=at, **PLAIN) for at in (0.0, 3.0))
    assert len(beside.world.see()) == 2
    _, (x, y) = beside.world.see()
    column, row = round(x - 0.5), round(y - 0.5)
    ring = [(column + 18, row), (column - 18, row), (column, row + 18), (column, row - 18)]
    one, two = picture_of(alone), picture_of(beside)
    assert all(two[at[1], at[0]] > 110 for at in ring)
    assert all(one[at[1], at[0]] < 110 for at in ring)
    assert two[row, column] < 60


def test_a_moved_camera_sees_the_tip_elsewhere():
    simulator = cell_before_camera(camera_moved_mm=2.0, camera_moved_toward_deg=30.0, **PLAIN)
    ((x, y),) = simulator.world.see()
    assert math.hypot(x - 640, y - 512) == pytest.approx(100.0, abs=0.5)
    assert place_px(simulator) == pytest.approx((x - 0.5, y - 0.5))


@pytest.mark.parametrize("mark", ["round", "cross"])
def test_fiducials_of_a_held_board_are_drawn_where_they_are(kind, mark):
    simulator = cell_before_camera(kind, board_held=True, board_mark=mark, **PLAIN)
    world = simulator.world
    fiducial_mm = world.marks(1)[0][0]
    middle = world.camera.middle_mm
    world.robot.carry(world.tips[1], tuple(a - b for a, b in zip(middle, fiducial_mm, strict=True)))
    grey = picture_of(simulator).astype(float)
    x, y = world.camera.optics.image_of(*world.camera.beside(world.marks(1)[0][0]))
    bright = np.clip(grey - 100, 0, None)[472:552, 600:680]
    at = np.arange(80) + 0.5
    centre = (600 + bright.sum(0) @ at / bright.sum(), 472 + bright.sum(1) @ at / bright.sum())
    assert centre == pytest.approx((x, y), abs=0.02)
    assert simulator.world.see() == ()


def test_markers_of_a_held_board_are_read_by_opencv():
    """The bits are those of the dictionary, and they are printed on the side that is seen."""
    cv2 = pytest.importorskip("cv2", reason="reading ArUco markers needs OpenCV")
    simulator = cell_before_camera(
        board_held=True,
        board_mark="aruco",
        board_mark_mm=3.0,
        picture_clutter=0,
        camera_mirrored=False,  # the picture of a camera that looks up, as it comes out of it
    )
    world = simulator.world
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    detector = cv2.aruco.ArucoDetector(dictionary)
    for number in range(4):
        place_mm = world.marks(1)[number][0]
        middle = world.camera.middle_mm
        world.robot.carry(
            world.tips[1], tuple(a - b for a, b in zip(middle, place_mm, strict=True))
        )
        corners, found, _ = detector.detectMarkers(picture_of(simulator))
        assert found is not None
        assert found.ravel().tolist() == [number + 1]
        assert corners[0].mean(axis=(0, 1)) == pytest.approx((639.5, 511.5), abs=0.6)


@each_row(
    ("name", "text"), [("tip_diameter_mm", "0"), ("tip_dirt", "21"), ("picture_clutter", "1000000")]
)
def test_what_cannot_be_drawn_is_refused(name, text):
    with pytest.raises(ConfigError, match=name):
        parameters_from_text({name: text})


def test_pictures_take_as_much_light_as_they_are_exposed():
    simulator = cell_before_camera(**PLAIN)
    usual = picture_of(simulator)
    for exposure, share in ((0.03, 0.0), (8.0, 0.9)):
        simulator.world.set_up(WorldParameters(picture_exposure=exposure, **PLAIN))
        grey = picture_of(simulator)
        assert (grey.max() < 12) == (exposure < 1)
        assert (cut_out(grey, 25) == 255).mean() >= share * (cut_out(usual, 25) > 100).mean()
