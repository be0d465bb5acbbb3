"""A vision project in a file, VCal, VxCalib, and a project that is saved and loaded."""

import math
from dataclasses import replace

import pytest
from robolink_simulators.epson.vision_file import install_vision

from robolink.errors import ConfigError
from tests.unit.spel_programs.test_vision import flange_over

FILE = """
schema = "robolink/vision/1"

[world]
camera_noise_px = 0.0

[[sequence]]
name = "findTip"
properties = {{ Calibration = "{calibration}" }}

  [[sequence.object]]
  name = "tip"
  properties = {{ NumberToFind = 0 }}

[[calibration]]
name = "exact"
exact = true

[[calibration]]
name = "taught"
poses = {poses}

[[calibration]]
name = "nine"
points = [[0, 0, 10, 20], [100, 0, 12, 20], [0, 100, 10, 22]]
"""
LOOK = (
    "Function main\nBoolean found\nDouble x, y, u\nVRun findTip\n"
    "VGet findTip.tip.RobotXYU, found, x, y, u\n"
    "Print found, Abs(x - CX(Here)) < 0.001, Abs(y - CY(Here)) < 0.001\nFend\n"
)
IN_THE_PICTURE_MM = (-3.0, 0.0, 3.0)


class CameraCell:
    """A controller with the tip at its camera, and tool 1 as accurate as wanted."""

    def __init__(self, cell, tmp_path) -> None:
        self.made = cell()
        self.simulator = self.made.simulator
        self.world = self.simulator.world
        self.path = tmp_path / "vision.toml"
        self.tip = self.world.tips[1]

    def load(self, program, *, calibration="exact", tool_error_mm=0.0, poses=None):
        stored = replace(self.tip, x_mm=self.tip.x_mm + tool_error_mm)
        self.simulator.machine.tools.set(1, stored)
        middle = flange_over(self.world, self.tip, 30.0)
        self.simulator.machine.tools.select(0)
        self.made.load(
            f"Function main\nTool 0\nGo XY({middle.x_mm!r}, {middle.y_mm!r}, "
            f"{middle.z_mm!r}, {middle.u_deg!r})\nTool 1\nFend\n"
        )
        self.made.run()
        self.made.load(program)
        listed = self.nine_poses() if poses is None else poses
        self.path.write_text(FILE.format(calibration=calibration, poses=listed))
        return install_vision(self.simulator, self.path)

    def nine_poses(self):
        """Return poses of the selected tool about its present place: TL, TC, TR, CR, C, CL ..."""
        at = self.simulator.machine.tip()
        rows = [IN_THE_PICTURE_MM, IN_THE_PICTURE_MM[::-1], IN_THE_PICTURE_MM]
        places = zip((3.0, 0.0, -3.0), rows, strict=True)
        return [[at.x_mm + dx, at.y_mm + dy, at.z_mm, at.u_deg] for dy, row in places for dx in row]


@pytest.fixture
def camera(cell, tmp_path):
    return CameraCell(cell, tmp_path)


def test_a_sequence_of_a_file_sees_the_tip(camera):
    vision = camera.load(LOOK)
    assert camera.made.run() == ["-1 -1 -1"]
    assert vision.runs == 1


def test_a_calibration_that_was_not_taken_is_an_error_until_vcal(camera):
    camera.load(LOOK, calibration="taught")
    camera.made.run()
    assert camera.made.runner.failure.number == camera.simulator.options.numbers.vision_calibration
    began_s = camera.made.now_s
    camera.load(LOOK.replace("VRun", "VCal taught\nVRun"), calibration="taught")
    assert camera.made.run() == ["-1 -1 -1"]
    assert camera.made.now_s - began_s > 9 * 0.5
    assert camera.simulator.machine.arm.moves_started >= 9


def test_a_calibration_with_a_wrong_tool_is_displaced_by_its_error(camera):
    """P. 874, and docs/reference/vision.md 3: not noticed with the tool used for it."""
    program = LOOK.replace("VRun", "VCal taught\nVRun").replace(
        "Fend", "Tool 0\nPrint Sqr((x - CX(Here)) ** 2 + (y - CY(Here)) ** 2)\nFend"
    )
    camera.load(program, calibration="taught", tool_error_mm=0.5)
    agrees, radius = camera.made.run()
    assert agrees == "-1 -1 -1"
    stored = camera.simulator.machine.tools.get(1)
    assert float(radius) == pytest.approx(math.hypot(stored.x_mm, stored.y_mm), abs=0.01)
    assert abs(float(radius) - math.hypot(camera.tip.x_mm, camera.tip.y_mm)) > 0.1


def test_vcal_that_sees_no_target_leaves_the_calibration_as_it_was(camera):
    far = [[300.0, 300.0, -100.0, 0.0]] * 9
    vision = camera.load(
        "Function main\nOnErr GoTo failed\nVCal taught\nPrint 1\nExit Function\n"
        "failed:\nPrint Err\nFend\n",
        poses=far,
    )
    assert camera.made.run() == [str(camera.simulator.options.numbers.vision_calibration)]
    assert not vision.project.calibrations["taught"].complete


def test_vcal_of_what_was_not_taught_is_refused(camera):
    camera.load("Function main\nVCal exact\nFend\n")
    camera.made.run()
    assert camera.made.runner.failure.number == camera.simulator.options.numbers.vision_calibration


def test_vload_takes_back_what_vset_changed_since_vsave(camera):
    lines = (
        "Integer e",
        "VSet findTip.ExposureTime, 5",
        "VSave",
        "VSet findTip.ExposureTime, 9",
        "VCls",
        "VLoad",
        "VGet findTip.ExposureTime, e",
        "Print e",
    )
    camera.load("\n".join(("Function main", *lines, "Fend")))
    assert camera.made.run() == ["5"]


def test_an_image_calibration_turns_pixels_into_places(printed, failure):
    """P. 871 to 880: nine points, X average and greatest error, mm per pixel."""
    points = [
        line
        for number, (px, py) in enumerate([(0, 0), (100, 0), (200, 0), (0, 100), (100, 100)])
        for line in (
            f"P{number} = XY({px}, {py}, 0, 0)",
            f"P{number + 10} = XY({10 + 0.02 * px}, {20 - 0.02 * py}, 0, 0)",
        )
    ]
    told = printed(
        *points,
        "Print VxCalInfo(1, 1)",
        "VxCalib 1, 3, P(0:4), P(10:14)",
        "Print VxCalInfo(1, 1)",
        'Print FmtStr$(VxCalInfo(1, 4), "0.0000")',
        "Print VxCalInfo(1, 3) < 0.0001, VxCalInfo(1, 9)",
        "P50 = XY(50, 50, 0, 0)",
        "P51 = VxTrans(1, P50)",
        'Print FmtStr$(CX(P51), "0.000")',
        'Print FmtStr$(CY(VxTrans(1, P50)), "0.000")',
    )
    assert told == ["0", "1", "0.0200", "-1 0", "11.000", "19.000"]
    riding = failure(*points, "VxCalib 1, 5, P(0:4), P(10:14)")
    assert (riding.number, riding.line) == (2199, len(points) + 2)
    assert failure("P1 = XY(1, 1, 0, 0)", "P2 = VxTrans(3, P1)").line == 3


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("exact = true", "exact = 1", "calibration.1.exact: must be true or false"),
        ("exact = true", "", "calibration.1: needs one of exact, points and poses"),
        ("[0, 100, 10, 22]", "[0, 100]", "calibration.3: needs four numbers"),
        ('name = "tip"', 'nam = "tip"', "did you mean name?"),
        ("camera_noise_px", "camera_noise", "no parameter 'camera_noise'"),
        ("NumberToFind", "NumberToSeek", "no property or result numbertoseek"),
        ("robolink/vision/1", "robolink/vision/2", "schema: must be"),
        ("[100, 0, 12, 20], [0, 100, 10, 22]", "[1, 1, 1, 1]", "do not calibrate a camera"),
    ],
)
def test_what_is_wrong_in_the_file_is_told_by_its_key(camera, old, new, told):
    camera.load(LOOK)
    text = camera.path.read_text()
    assert old in text
    camera.path.write_text(text.replace(old, new, 1))
    with pytest.raises(ConfigError) as caught:
        install_vision(camera.simulator, camera.path)
    assert told in str(caught.value)
