"""Faults of a simulated cell, by name, for both kinds of robots; and its camera."""

import math
import random
from dataclasses import fields, replace
from pathlib import Path
from statistics import fmean, pstdev

import pytest
from robolink_cli.commands.simulate.service import world_from
from robolink_simulators.cell.camera import CameraOptics, CameraTruth
from robolink_simulators.cell.tip_switches import LightBeam, TouchPlate
from robolink_simulators.cell.world_parameters import (
    WorldParameters,
    parameter_names,
    parameters_from_text,
)
from robolink_simulators.control.assist import perform
from robolink_simulators.epson import EpsonSimulator
from robolink_simulators.epson.arm.kinematics import inverse
from robolink_simulators.hosting.in_process import epson as in_process
from robolink_simulators.hosting.in_process import softmotion as plc_in_process
from robolink_simulators.softmotion.mailbox.simulator import SoftMotionSimulator

from robolink.errors import ConfigError
from robolink.messages import known_names
from robolink.model import ToolOffset
from robolink.transport import parse_url
from tests._rows import each_row

KINDS = {"epson": EpsonSimulator, "softmotion": SoftMotionSimulator}


@pytest.fixture(params=KINDS)
def make(request):
    return lambda **parameters: KINDS[request.param](seed=2, world=WorldParameters(**parameters))


def jogged(simulator, by_mm, axis=0):
    """Jog the robot along one axis, and return the distance that its tip really moved."""
    world = simulator.world
    before, step = world.tip_mm(), [0.0, 0.0, 0.0]
    step[axis] = by_mm
    world.robot.carry(world.tips[1], tuple(step))
    return world.tip_mm()[axis] - before[axis]


def test_a_new_cell_is_without_faults_but_for_the_scatter_of_eye_and_camera(make):
    simulator = make()
    assert jogged(simulator, 1.0) == pytest.approx(1.0, abs=1e-6)
    assert jogged(simulator, -1.0) == pytest.approx(-1.0, abs=1e-6)
    assert simulator.world.lean_of(1) == (0.0, 0.0)


def test_play_is_lost_when_the_way_turns(make):
    simulator = make(backlash_deg=0.02, backlash_mm=0.05)
    for axis, least_mm in ((0, 0.005), (2, 0.049)):
        jogged(simulator, 1.0, axis)
        assert jogged(simulator, 1.0, axis) == pytest.approx(1.0, abs=1e-3)
        lost_mm = 1.0 + jogged(simulator, -1.0, axis)
        assert abs(lost_mm) > least_mm


def test_a_tool_that_is_turned_on_the_flange_keeps_its_tip(make):
    straight, turned = make().world, make(tool_u_deg=14, tool_v_deg=7, tool_w_deg=356).world
    assert turned.tip_mm() == pytest.approx(straight.tip_mm())
    assert turned.pin_mm == straight.pin_mm
    assert straight.axis("z") == pytest.approx((0, 0, 1), abs=1e-9)
    x, z = (turned.axis(name) for name in ("x", "z"))
    assert sum(a * b for a, b in zip(x, z, strict=True)) == pytest.approx(0.0, abs=1e-12)
    # R = Rz(14) Ry(7) Rx(-4)
    assert z[2] == pytest.approx(math.cos(math.radians(7)) * math.cos(math.radians(4)))
    assert x[2] == pytest.approx(-math.sin(math.radians(7)))
    turned.set_up(WorldParameters())
    assert turned.axis("z") == pytest.approx((0, 0, 1), abs=1e-9)


def test_a_gantry_has_play_in_its_linear_axes():
    simulator = SoftMotionSimulator("Kin_Gantry3", seed=2, world=WorldParameters(backlash_mm=0.05))
    jogged(simulator, 1.0)
    assert jogged(simulator, -1.0) == pytest.approx(-0.95)


def test_an_eye_is_now_and_then_far_off(make):
    world = make(eye_sigma_mm=0.001, eye_outlier_share=0.3, eye_outlier_mm=0.4).world
    world.operator._require_jogging = lambda: None
    misses = []
    for _ in range(60):
        world.operator.jog_onto_pin()
        pin, tip = world.pin_mm, world.tip_mm()
        misses.append(math.hypot(pin[0] - tip[0], pin[1] - tip[1]))
    wrong = [miss for miss in misses if miss > 0.1]
    assert 8 <= len(wrong) <= 30
    assert fmean(wrong) == pytest.approx(0.4, abs=0.02)


def test_a_bent_needle_breaks_a_beam_beside_its_tip(make):
    straight, bent = make(), make(lean_deg=5.0, lean_toward_deg=0.0)
    for simulator, broken in ((straight, True), (bent, False)):
        world = simulator.world
        x_mm, y_mm, z_mm = world.tip_mm()
        heading = math.degrees(math.atan2(*reversed(_toward(simulator))))
        beam = LightBeam((x_mm, y_mm, z_mm + 10.0), heading + 90.0, nozzle_radius_mm=0.3)
        world.connect(5, beam)
        assert read_input(simulator, 5) is broken


@pytest.mark.parametrize(("height_mm", "beside_mm"), [(0.5, 0.5), (4.0, 4.0), (9.0, 4.0)])
def test_a_needle_bent_at_a_height_stands_upright_above_it(make, height_mm, beside_mm):
    simulator = make(lean_deg=45.0, lean_up_to_mm=4.0)
    world = simulator.world
    along_x, along_y = _toward(simulator)
    x_mm, y_mm, z_mm = world.tip_mm()
    heading = math.degrees(math.atan2(along_y, along_x)) + 90.0
    for off_mm, broken in ((0.0, True), (-0.2, False), (0.2, False)):
        beside = beside_mm + off_mm
        place = (x_mm + beside * along_x, y_mm + beside * along_y, z_mm + height_mm)
        world.connect(5, LightBeam(place, heading, nozzle_radius_mm=0.1))
        assert read_input(simulator, 5) is broken, off_mm


def test_beams_that_were_moved_are_broken_elsewhere(make):
    simulator = make(beams_moved_mm=2.0, beams_moved_toward_deg=90.0)
    world = simulator.world
    x_mm, y_mm, z_mm = world.tip_mm()
    for away_mm, broken in ((-2.0, True), (0.0, False)):
        world.connect(5, LightBeam((x_mm, y_mm + away_mm, z_mm + 3.0), 0.0))
        assert read_input(simulator, 5) is broken
    plate_z_mm = z_mm + 0.1
    world.connect(5, TouchPlate(plate_z_mm))
    assert read_input(simulator, 5), "a plate is no beam and stays"


def _toward(simulator):
    """Return the direction of the flange's X in the base."""
    robot = simulator.world.robot
    origin, along = robot.tip_mm(ToolOffset()), robot.tip_mm(ToolOffset(1.0))
    return along[0] - origin[0], along[1] - origin[1]


def read_input(simulator, number):
    if isinstance(simulator, EpsonSimulator):
        return simulator.machine.inputs.get(number)
    group = simulator.plc.group
    return group.inputs.read(number, group.values)


def test_scatter_of_an_input_is_drawn_anew_for_each_movement():
    simulator = SoftMotionSimulator(seed=2)
    world, group = simulator.world, simulator.plc.group
    x_mm, y_mm, z_mm = world.tip_mm()
    world.connect(
        5, LightBeam((x_mm + 0.25, y_mm, z_mm + 1.0), 90.0, nozzle_radius_mm=0.25), noise_mm=0.1
    )
    shown = []
    for _ in range(40):
        group.motions.add(0)
        assert read_input(simulator, 5) is read_input(simulator, 5)
        shown.append(read_input(simulator, 5))
    assert 8 < sum(shown) < 32


def optics(**values):
    return CameraOptics(**{"noise_px": 0.0, **values})


def seen(places, **values):
    return CameraTruth((0.0, 0.0, 0.0), optics(**values), random.Random(1)).picture(places)


def test_a_camera_maps_by_scale_turn_shear_and_mirror():
    told = {"um_per_px_x": 20.0, "um_per_px_y": 25.0, "turn_deg": 30.0, "shear_deg": 4.0}
    for mirrored in (True, False):
        (a, b), (c, d) = optics(**told, mirrored=mirrored).mm_per_px
        assert (a * d - b * c < 0) is mirrored
        assert (math.hypot(a, c), math.hypot(b, d)) == pytest.approx((0.02, 0.025))
        assert math.degrees(math.atan2(c, a)) == pytest.approx(30.0)
        ((px, py),) = seen([(1.3, -0.7, 0.0)], **told, mirrored=mirrored)
        dx, dy = px - 640, py - 512
        assert (a * dx + b * dy, c * dx + d * dy) == pytest.approx((1.3, -0.7))


def test_a_leaning_lens_sees_what_is_higher_beside_where_it_is_and_farther_smaller():
    leaning = {"tilt_deg": 5.0, "tilt_toward_deg": 90.0, "turn_deg": 0.0, "mirrored": False}
    ((_, low),) = seen([(0.0, 0.0, 0.0)], **leaning)
    ((_, high),) = seen([(0.0, 0.0, 1.0)], **leaning)
    assert low == pytest.approx(512)
    assert high - low == pytest.approx(-math.sin(math.radians(5.0)) * 50, rel=0.02)
    ((near, _),) = seen([(2.0, 0.0, 0.0)], turn_deg=0.0)
    ((far, _),) = seen([(2.0, 0.0, 1.2)], turn_deg=0.0)
    assert (far - 640) / (near - 640) == pytest.approx(120 / 121.2)


def test_what_is_out_of_the_image_or_of_focus_is_not_seen():
    assert seen([(0.0, 0.0, 0.0), (13.5, 0.0, 0.0), (0.0, 0.0, 2.5)]) != ()
    assert len(seen([(0.0, 0.0, 0.0), (13.5, 0.0, 0.0), (0.0, 0.0, 2.5)])) == 1


def test_a_finder_scatters_errs_and_misses_as_often_as_it_is_told():
    camera = CameraTruth((0, 0, 0), optics(noise_px=0.2), random.Random(3))
    xs = [camera.picture([(0.0, 0.0, 0.0)])[0][0] for _ in range(400)]
    assert pstdev(xs) == pytest.approx(0.2, rel=0.15)
    camera.optics = optics(outlier_share=0.1, miss_share=0.2)
    pictures = [camera.picture([(0.0, 0.0, 0.0)]) for _ in range(400)]
    assert 50 <= sum(not found for found in pictures) <= 110
    wrong = [math.hypot(x - 640, y - 512) for ((x, y),) in filter(None, pictures)]
    assert 15 <= sum(miss > 1 for miss in wrong) <= 50
    assert max(wrong) == pytest.approx(40.0)


def test_a_held_board_hides_the_tip_and_shows_its_fiducials(make):
    simulator = make(board_held=True)
    world = simulator.world
    x_mm, y_mm, z_mm = world.camera.middle_mm
    first, tip = world.board.fiducials(world.tips[1])[0], world.tips[1]
    for place, tips, fiducials in ((tip, 0, 0), (first, 0, 1)):
        here = world.robot.tip_mm(place)
        world.robot.carry(place, (x_mm - here[0], y_mm - here[1], z_mm - here[2]))
        assert (len(world.see()), len(world.see(1))) == (tips, fiducials)
    world.set_up(replace(world.parameters, board_held=False))
    here = world.tip_mm()
    world.robot.carry(tip, (x_mm - here[0], y_mm - here[1], z_mm - here[2]))
    assert (len(world.see()), len(world.see(1))) == (1, 0)


def test_the_same_seed_gives_the_same_camera_board_and_pictures(make):
    one, other = make(board_held=True), make(board_held=True)
    assert one.world.camera.middle_mm == other.world.camera.middle_mm
    assert one.world.truth() == other.world.truth()


def test_the_assist_port_furnishes_and_spoils_a_cell(make):
    simulator = make()
    answer = perform(
        simulator, {"do": "set_world", "backlash_deg": 0.5, "board_held": 1, "camera_mirrored": 0}
    )
    told = answer["parameters"]
    assert isinstance(told, dict)
    assert (told["backlash_deg"], told["board_held"], told["camera_mirrored"]) == (0.5, True, False)
    assert simulator.world.truth()["board"] is not None
    assert perform(simulator, {"do": "see"}) == {"seen": [], "radii_px": []}
    x_mm, y_mm, z_mm = simulator.world.tip_mm()
    place = {"x_mm": x_mm, "y_mm": y_mm, "z_mm": z_mm + 1.0}
    perform(simulator, {"do": "mount_beam", "number": 6, **place, "heading_deg": 20, "tilt_deg": 2})
    perform(simulator, {"do": "mount_plate", "number": 7, "z_mm": z_mm - 5.0, "noise_mm": 0.001})
    assert read_input(simulator, 6)
    assert not read_input(simulator, 7)


@each_row(
    ("request_", "said"),
    [
        ({"do": "set_world", "wind": 1}, "no parameter 'wind'"),
        ({"do": "set_world", "camera_turn_deg": "round"}, "needs camera_turn_deg, a number"),
        ({"do": "set_world", "camera_um_per_px_x": 0}, "from 1e-06"),
        ({"do": "mount_plate", "number": 7}, "needs z_mm"),
        (
            {"do": "mount_plate", "number": 7, "z_mm": 1, "noise_mm": -1},
            "noise_mm, a number from 0",
        ),
        ({"do": "mount_beam", "number": 7, "x_mm": 1, "y_mm": 1, "z_mm": True}, "needs z_mm"),
    ],
)
def test_what_makes_no_world_is_refused(request_, said):
    simulator = EpsonSimulator(seed=2)
    before = simulator.world.truth()
    with pytest.raises(ConfigError, match=said):
        perform(simulator, request_)
    assert simulator.world.truth() == before


@pytest.mark.parametrize(
    ("kind", "hosting"), [("epson", in_process), ("softmotion", plc_in_process)]
)
def test_a_sim_url_says_what_goes_wrong(kind, hosting):
    name = f"world-url-{kind}"
    url = f"{kind}+sim://{name}?seed=2&world.lean_deg=3&world.camera_noise_px=0.5"
    opener = in_process.open_epson if kind == "epson" else plc_in_process.open_softmotion
    try:
        opener(parse_url(url))
        parameters = hosting.simulator_named(name).world.parameters
        assert (parameters.lean_deg, parameters.camera_noise_px) == (3.0, 0.5)
    finally:
        hosting.unregister(name)
    with pytest.raises(ConfigError, match="no parameter 'wind'"):
        opener(parse_url(f"{kind}+sim://{name}?world.wind=3"))


def test_the_command_line_says_it_too():
    assert world_from(["lean_deg=3", "board_held=yes"]) == WorldParameters(
        lean_deg=3.0, board_held=True
    )
    with pytest.raises(ConfigError) as caught:
        world_from(["wind=3"])
    assert caught.value.remedy == known_names(parameter_names(), "wind")


def test_play_of_an_arm_that_was_placed_by_hand_is_that_of_its_last_way():
    simulator = EpsonSimulator(seed=2, world=WorldParameters(backlash_deg=0.02))
    arm, world = simulator.machine.arm, simulator.world
    before = world.tip_mm()
    flange = arm.flange()
    for dx_mm in (2.0, 0.0):
        target = replace(flange, x_mm=flange.x_mm + dx_mm)
        arm.place(inverse(arm.model, target, arm.hand), 0)
    assert math.dist(world.tip_mm()[:2], before[:2]) > 0.01


def see(simulator, times=1):
    return [perform(simulator, {"do": "see"}) for _ in range(times)][-1]


def before_the_lens(simulator):
    world = simulator.world
    way = (b - a for a, b in zip(world.tip_mm(), world.camera.middle_mm, strict=True))
    world.robot.carry(world.tips[1], tuple(way))


def test_a_finder_takes_a_spot_that_stands_still_for_the_tip(make):
    simulator = make(camera_noise_px=0.0)
    before_the_lens(simulator)
    jogged(simulator, 1.0)
    width, height = simulator.world.camera.optics.size_px
    (true,) = see(simulator)["seen"]
    fleck = pytest.approx([width / 2, height / 2 + 30.0])
    assert true != fleck
    faults = {"camera_still_share": 1, "camera_still_beside_px": 30, "camera_still_toward_deg": 90}
    perform(simulator, {"do": "set_world", **faults, "camera_still_from_picture": 3})
    assert [see(simulator)["seen"] for _ in range(4)] == [[true], [true], [fleck], [fleck]]
    # Only with no tip in the picture.
    perform(simulator, {"do": "set_world", **faults, "camera_still_unseen": 1})
    assert see(simulator, 3)["seen"] == [true]
    jogged(simulator, 10.0, axis=2)
    assert see(simulator, 3)["seen"] == [fleck]
    # Now and then, and never without the fault.
    perform(simulator, {"do": "set_world", "camera_still_share": 0.5, "camera_still_unseen": 0})
    assert {len(see(simulator)["seen"]) for _ in range(20)} == {0, 1}
    perform(simulator, {"do": "set_world", "camera_still_share": 0})
    assert see(simulator)["seen"] == []


def test_a_finder_tells_the_radius_of_a_spot_and_it_may_swell(make):
    simulator = make()
    before_the_lens(simulator)
    assert see(simulator)["radii_px"] == []
    spots = {"camera_spot_radius_px": 12, "camera_spot_swells_by": 0.25}
    perform(simulator, {"do": "set_world", **spots, "camera_spot_swells_from_picture": 3})
    radii = [see(simulator)["radii_px"][0] for _ in range(4)]
    assert radii == pytest.approx([12.0, 12.0, 15.0, 15.0], abs=0.3)


def test_what_a_camera_sees_beside_the_tip_turns_with_it(make):
    simulator = make(camera_noise_px=0.0)
    before_the_lens(simulator)
    world, seen = simulator.world, {}
    for turn_deg in (0.0, 180.0):
        world.robot.turn(turn_deg)
        before_the_lens(simulator)
        for beside_px in (0.0, 8.0):
            tip = {"camera_tip_beside_px": beside_px, "camera_tip_beside_toward_deg": 30}
            perform(simulator, {"do": "set_world", **tip})
            (seen[turn_deg, beside_px],) = see(simulator)["seen"]
    shifts = []
    for turn_deg in (0.0, 180.0):
        (x0, y0), (x1, y1) = seen[turn_deg, 0.0], seen[turn_deg, 8.0]
        shifts.append((x1 - x0, y1 - y0))
        assert math.hypot(*shifts[-1]) == pytest.approx(8.0, abs=0.1)
    assert shifts[0] == pytest.approx((-shifts[1][0], -shifts[1][1]), abs=0.2)
    assert math.dist(world.tip_mm()[:2], world.camera.middle_mm[:2]) < 0.01, "it is where it was"


def test_a_share_of_still_spots_is_a_share():
    with pytest.raises(ConfigError, match="above 1"):
        parameters_from_text({"camera_still_share": "1.5"})
    with pytest.raises(ConfigError, match="a number from 0 to 1"):
        perform(EpsonSimulator(seed=2), {"do": "set_world", "camera_still_share": 1.5})


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [("camera_turn_deg", "round", "cannot be 'round'"), ("camera_um_per_px_x", "0", "0 long")],
)
def test_an_option_that_makes_no_world_is_refused(name, text, said):
    with pytest.raises(ConfigError, match=said):
        parameters_from_text({name: text})


def test_the_page_names_every_parameter():
    page = (Path(__file__).parents[2] / "docs/reference/simulated-cell.md").read_text(
        encoding="utf-8"
    )
    assert [it.name for it in fields(WorldParameters) if f"`{it.name}`" not in page] == []
