"""Vision Guide, and the two programs that calculate a tool with it (docs/reference/vision.md)."""

import math
import struct
from dataclasses import astuple, replace
from pathlib import Path

import pytest
from robolink_simulators.cell.camera import SimulatedBoard
from robolink_simulators.epson.camera_calibrations import VisionCalibration
from robolink_simulators.epson.vision_project import VisionObject, VisionProject, VisionSequence
from robolink_simulators.epson.vision_system import VisionSystem

from robolink.calibration import CameraModel, Sighting, solve_board, solve_up_camera
from robolink.errors import ConfigError
from robolink.model import TIP, Pose, ToolOffset

COMPANIONS = Path(__file__).parents[3] / "companions" / "epson"
BEFORE = ToolOffset(12.0, -3.5, -20.0, 7.0)
CALC = "\nFunction main\n  Tool 1\n  Print {name}, Tool, CX(TLSet(1)), CU(TLSet(1))\nFend\n"


def flange_over(world, place: ToolOffset, u_deg: float, *, beside=(0.0, 0.0)) -> Pose:
    """Return the flange pose that brings a place on the flange to the lens."""
    x_mm, y_mm, z_mm = world.camera.middle_mm
    cos, sin = math.cos(math.radians(u_deg)), math.sin(math.radians(u_deg))
    dx, dy = place.x_mm * cos - place.y_mm * sin, place.x_mm * sin + place.y_mm * cos
    return Pose(x_mm + beside[0] - dx, y_mm + beside[1] - dy, z_mm - place.z_mm, u_deg)


class VisionCell:
    """A controller with vision and one program in it."""

    def __init__(self, made) -> None:
        self.made = made
        self.simulator = made.simulator
        self.world = made.simulator.world
        self.tools = made.simulator.machine.tools
        self.tools.set(1, BEFORE)
        self.furnish(camera_noise_px=0.0)

    def furnish(self, **parameters):
        self.world.set_up(replace(self.world.parameters, **parameters))

    def load(self, text, *, calibration=None, **files):
        self.made.load(text, **files)
        upward = calibration or VisionCalibration.of_camera(self.world.camera)
        marked = {"calibration": "up"}
        sequences = [
            VisionSequence("findTip", [VisionObject("tip")], marked),
            VisionSequence("SearchFid1", [VisionObject("Corr01", mark=1)], marked),
            VisionSequence("SearchFid2", [VisionObject("Corr01", mark=2)], marked),
            VisionSequence("bare", [VisionObject("tip")]),
        ]
        project = VisionProject.of(sequences, up=upward)
        options = self.simulator.options
        vision = VisionSystem(project, lambda: self.simulator.world, options)
        self.made.runner.vision = vision
        return vision

    def calc(self, program: str, name: str, **files):
        """Run one of the two programs; return its output, and tool 1 afterwards."""
        text = (COMPANIONS / program).read_text(encoding="utf-8")
        self.load(text + CALC.format(name=name), **files)
        printed = self.run()
        return printed, self.tools.get(1)

    def run(self):
        printed = self.made.run()
        assert self.made.runner.failure is None, self.made.runner.failure
        return printed

    def stand(self, flange: Pose) -> None:
        """Move the arm there."""
        self.move_by(f"Go XY({flange.x_mm!r}, {flange.y_mm!r}, {flange.z_mm!r}, {flange.u_deg!r})")

    def move_by(self, line: str) -> None:
        self.made.load(f"Function main\n  Tool 0\n  {line}\n  Tool 1\nFend\n")
        self.run()

    def sighting(self, mark: int = TIP) -> Sighting:
        """Return the sighting that `camera` and `board` would get from a picture taken now."""
        ((px, py),) = self.world.see(mark)
        truth = self.world.truth()["camera"]
        (a, b), (c, d) = truth["mm_per_px"]
        (width, height), (x_mm, y_mm, _) = truth["size_px"], truth["middle_mm"]
        origin = (x_mm - (a * width + b * height) / 2, y_mm - (c * width + d * height) / 2)
        at = CameraModel(((a, b), (c, d)), origin).base_mm(px, py)
        return Sighting(self.world.robot.flange(), *at)


@pytest.fixture
def vision_cell(cell):
    """A cell whose stored tool 1 differs from its tip."""
    return VisionCell(cell())


@pytest.mark.parametrize("u_deg", [30.0, -150.0])
def test_calc_tool_finds_what_camera_finds(vision_cell, u_deg):
    tip = vision_cell.world.tips[1]
    vision_cell.stand(flange_over(vision_cell.world, tip, u_deg, beside=(1.5, -0.7)))
    printed, tool = vision_cell.calc("calc_tool.prg", "CalcTool")
    solved = solve_up_camera(vision_cell.sighting(), stored=BEFORE).offset
    assert astuple(tool) == pytest.approx(astuple(solved), abs=1e-6)
    assert astuple(tool)[:2] == pytest.approx((tip.x_mm, tip.y_mm), abs=1e-6)
    assert (tool.z_mm, tool.u_deg) == (BEFORE.z_mm, BEFORE.u_deg)
    assert printed[0].split()[:2] == ["-1", "1"]  # and tool 1 is selected again


def board_cell(vision_cell, *, swapped=False):
    """Let the nozzle hold a board; return the taught places of its fiducials."""
    world = vision_cell.world
    drawing = ((18.0, 2.0), (-22.0, 1.0))
    vision_cell.furnish(board_held=True)
    world.board = SimulatedBoard((0.3, -0.2), 4.0, drawing[::-1] if swapped else drawing)
    fiducials = world.board.fiducials(world.tips[1])
    taught = [
        flange_over(world, at, u, beside=beside)
        for at, u, beside in zip(fiducials, (20.0, -35.0), ((0.5, 0.25), (-1.0, 0.5)), strict=True)
    ]
    points = "".join(
        f"P{i} = XY({p.x_mm!r}, {p.y_mm!r}, {p.z_mm!r}, {p.u_deg!r})\n  PLabel {i}, "
        f'"Fid{i}CamPos"\n  '
        for i, p in enumerate(taught, start=1)
    )
    vision_cell.made.load(f"Function main\n  LimZ 0\n  {points}\nFend\n")
    vision_cell.run()
    return fiducials, taught


def test_calc_board_tool_finds_what_board_finds(vision_cell):
    _, taught = board_cell(vision_cell)
    sightings = []
    for number in (1, 2):
        vision_cell.move_by(f"Go P{number}")
        sightings.append(vision_cell.sighting(number))
    printed, tool = vision_cell.calc("calc_board_tool.prg", "CalcBoardTool")
    solved = solve_board(*sightings, stored=BEFORE).offset
    assert astuple(tool) == pytest.approx(astuple(solved), abs=1e-6)
    truth = vision_cell.world.board.frame(vision_cell.world.tips[1])
    direction = truth.u_deg + math.degrees(math.atan2(1.0, 40.0))  # of the line through both
    assert tool.u_deg == pytest.approx(direction, abs=1e-6)
    assert tool.z_mm == BEFORE.z_mm
    assert printed[0].split()[:2] == ["-1", "1"]
    assert taught[0].u_deg != taught[1].u_deg


def test_exchanged_fiducials_turn_the_board_by_half_a_turn(vision_cell):
    board_cell(vision_cell)
    _, tool = vision_cell.calc("calc_board_tool.prg", "CalcBoardTool")
    vision_cell.tools.set(1, BEFORE)
    board_cell(vision_cell, swapped=True)
    _, other = vision_cell.calc("calc_board_tool.prg", "CalcBoardTool")
    assert abs(tool.u_deg - other.u_deg) == pytest.approx(180.0, abs=1e-6)
    assert astuple(tool)[:2] == pytest.approx(astuple(other)[:2], abs=1e-6)


@pytest.mark.parametrize(
    ("program", "name"), [("calc_tool.prg", "CalcTool"), ("calc_board_tool.prg", "CalcBoardTool")]
)
@pytest.mark.parametrize("trouble", ["nothing found", "no camera"])
def test_what_is_not_found_leaves_the_tool_alone(vision_cell, program, name, trouble):
    board_cell(vision_cell)
    vision_cell.furnish(camera_miss_share=1.0)
    text = (COMPANIONS / program).read_text(encoding="utf-8") + CALC.format(name=name)
    vision = vision_cell.load(text)
    vision.answers = trouble != "no camera"
    assert vision_cell.run()[0].split()[:2] == ["0", "1"]
    assert vision_cell.tools.get(1) == BEFORE
    assert vision.runs == (trouble == "nothing found")


def test_without_tool_0_the_board_is_wrong_by_the_tool_that_taught_the_points(vision_cell):
    board_cell(vision_cell)
    _, right = vision_cell.calc("calc_board_tool.prg", "CalcBoardTool")
    vision_cell.tools.set(1, BEFORE)
    # The pendant notes the same places as those of tool 1; the manual's program uses them.
    noted = "  ".join(
        f"Tool 0\n  Go P{n}\n  Tool 1\n  P{n} = XY(CX(Here), CY(Here), CZ(Here), CU(Here))\n"
        for n in (1, 2)
    )
    vision_cell.made.load(f"Function main\n  {noted}Fend\n")
    vision_cell.run()
    text = (COMPANIONS / "calc_board_tool.prg").read_text(encoding="utf-8")
    vision_cell.load(text.replace("  Tool 0\n", "") + CALC.format(name="CalcBoardTool"))
    vision_cell.run()
    wrong = vision_cell.tools.get(1)
    cos, sin = math.cos(math.radians(BEFORE.u_deg)), math.sin(math.radians(BEFORE.u_deg))
    x_mm = BEFORE.x_mm + wrong.x_mm * cos - wrong.y_mm * sin
    y_mm = BEFORE.y_mm + wrong.x_mm * sin + wrong.y_mm * cos
    assert (x_mm, y_mm) == pytest.approx((right.x_mm, right.y_mm), abs=1e-6)
    assert wrong.u_deg + BEFORE.u_deg == pytest.approx(right.u_deg, abs=1e-6)


LOOK = """
Function main
  Boolean found
  Double x, y, u
  Integer n, ms
  String s$
  {lines}
Fend
"""


def looked(vision_cell, *lines, **calibration):
    """Run lines with the usual variables declared; return the vision system and the output."""
    vision = vision_cell.load(LOOK.format(lines="\n  ".join(lines)), **calibration)
    return vision, vision_cell.made.run()


def at_camera(vision_cell, u_deg=30.0, beside=(1.0, -0.5)):
    """Bring the tip to the lens."""
    world = vision_cell.world
    vision_cell.stand(flange_over(world, world.tips[1], u_deg, beside=beside))


def test_robot_and_tool_results_of_a_tip(vision_cell):
    tip = vision_cell.world.tips[1]
    at_camera(vision_cell)
    x_mm, y_mm, _ = vision_cell.world.tip_mm()
    _, printed = looked(
        vision_cell,
        's$ = "FINDTIP"',
        "VRun s$",
        "VGet s$.tip.RobotXYU, found, x, y, u",
        'Print FmtStr$(x, "0.00000"), ":", FmtStr$(y, "0.00000"), ":", FmtStr$(u, "0.00000")',
        "VGet findTip.tip.RobotToolXYU(1), found, x, y, u",
        'Print FmtStr$(x, "0.00000"), ":", FmtStr$(y, "0.00000"), ":", FmtStr$(u, "0.00000")',
        "VGet findTip.tip.NumberFound, n ; VGet findTip.Time, ms",
        "Print n, ms",
    )
    seen, tool = ([float(part) for part in line.split(":")] for line in printed[:2])
    assert seen == pytest.approx((x_mm, y_mm, 30.0 + tip.u_deg), abs=1e-4)
    assert tool == pytest.approx((tip.x_mm, tip.y_mm, tip.u_deg), abs=1e-4)
    assert printed[2].split() == ["1", "45"]


def test_a_right_tool_shows_the_tip_where_here_is(vision_cell):
    at_camera(vision_cell, u_deg=-70.0)
    vision_cell.tools.set(1, vision_cell.world.tips[1])
    vision_cell.move_by("Wait 0")
    _, printed = looked(
        vision_cell,
        "VRun findTip",
        "VGet findTip.tip.RobotXYU, found, x, y, u",
        "Print Abs(x - CX(Here)) < 0.00001, Abs(y - CY(Here)) < 0.00001",
    )
    assert printed[0].split() == ["-1", "-1"]


def test_the_picture_in_memory_is_looked_at_again_after_a_move(vision_cell):
    at_camera(vision_cell)
    _, printed = looked(
        vision_cell,
        "VRun findTip ; VGet findTip.tip.RobotX, x",
        "Tool 0 ; Go Here +X(0.8)",
        "VSet findTip.RuntimeAcquire, 0",
        "VRun findTip ; VGet findTip.tip.RobotX, y",
        "VSet findTip.RuntimeAcquire, 1",
        "VRun findTip ; VGet findTip.tip.RobotX, u",
        "Print x = y, Abs(u - x - 0.8) < 0.00001",
    )
    assert printed[0].split() == ["-1", "-1"]


@pytest.mark.parametrize(("option", "kept"), [("keep", "5"), ("zero", "0")])
def test_a_miss_is_a_miss(cell, option, kept):
    missing = VisionCell(cell(vision_not_found=option))
    at_camera(missing)
    missing.furnish(camera_miss_share=1.0)
    _, printed = looked(
        missing,
        "x = 5 ; found = True",
        "VRun findTip ; VGet findTip.tip.RobotXYU, found, x, y, u",
        "Print found, x",
    )
    assert printed[0].split() == ["0", kept]


@pytest.mark.parametrize(
    ("lines", "number"),
    [
        (["VRun nosuch"], 2543),
        (["VRun findTip ; VGet findTip.other.Found, found"], 2544),
        (["VRun findTip ; VGet findTip.tip.Sharpness, x"], 7803),
        (["VRun bare ; VGet bare.tip.RobotXYU, found, x, y, u"], 7804),
        (['VSet bare.Calibration, "nosuch"', "VRun bare ; VGet bare.tip.RobotX, x"], 2545),
        (["VSet findTip.Camera, 2", "VRun findTip"], 7806),
        (["VSet findTip.Camera, s$"], 2130),
        (["VSet bare.RuntimeAcquire, 0", "VRun bare"], 7806),
    ],
)
def test_errors_of_vision_reach_the_handler(vision_cell, lines, number):
    at_camera(vision_cell)
    _, printed = looked(
        vision_cell,
        "OnErr GoTo bad",
        *lines,
        "Exit Function",
        "bad:",
        "Print Err",
        "EResume ended",
        "ended:",
    )
    assert printed == [str(number)]


def test_an_uncalibrated_camera_may_say_zero(cell):
    lenient = VisionCell(cell(uncalibrated_robot_result="zero"))
    at_camera(lenient)
    _, printed = looked(
        lenient, "x = 5", "VRun bare ; VGet bare.tip.RobotXYU, found, x, y, u", "Print found, x"
    )
    assert printed[0].split() == ["-1", "0"]


def test_noise_and_false_finds_come_from_the_world(vision_cell):
    at_camera(vision_cell)
    vision_cell.furnish(camera_noise_px=0.5, camera_outlier_share=0.2)
    _, printed = looked(
        vision_cell,
        "For n = 1 To 60",
        "  VRun findTip ; VGet findTip.tip.PixelXYU, found, x, y, u",
        '  Print FmtStr$(x, "0.00")',
        "Next",
    )
    across = sorted(float(line) for line in printed)
    middle = across[30]
    near = [x - middle for x in across if abs(x - middle) < 3]
    assert 0.3 < math.sqrt(sum(d * d for d in near) / len(near)) < 0.75
    assert 2 <= 60 - len(near) <= 25  # off by 40 px in any direction


def test_nine_points_calibrate_what_was_taken(vision_cell):
    camera = vision_cell.world.camera
    true = VisionCalibration.of_camera(camera)
    pixels = [(x, y) for y in (100.0, 500.0, 900.0) for x in (100.0, 600.0, 1100.0)]
    fitted = VisionCalibration.of_points(pixels, [true.robot_mm(pixel) for pixel in pixels])
    assert fitted.robot_mm((321.0, 777.0)) == pytest.approx(true.robot_mm((321.0, 777.0)), abs=1e-9)
    assert fitted.robot_deg(40.0) == pytest.approx(true.robot_deg(40.0), abs=1e-9)
    with pytest.raises(ConfigError):
        VisionCalibration.of_points(pixels[:3], [true.robot_mm(pixel) for pixel in pixels[:3]])


@pytest.mark.parametrize("calibration", [{"complete": False}, {"mounting": 2}])
def test_tool_results_need_a_whole_calibration_that_looks_up(vision_cell, calibration):
    at_camera(vision_cell)
    other = replace(VisionCalibration.of_camera(vision_cell.world.camera), **calibration)
    looked(
        vision_cell,
        "VRun findTip ; VGet findTip.tip.RobotToolXYU, found, x, y, u",
        calibration=other,
    )
    assert vision_cell.made.runner.failure.number == 2545


def test_no_vision_in_tasks_that_stops_do_not_touch(vision_cell):
    vision_cell.load(
        "Function main\n Xqt 2, look, NoEmgAbort\nFend\nFunction look\n VRun findTip\nFend"
    )
    vision_cell.made.run()
    assert vision_cell.made.runner.failure.number == 2295


def test_vget_into_too_few_variables_is_told_at_the_build(faults):
    text = "Function main\nBoolean f\nReal x\nVGet a.b.RobotXYU, f, x\nFend"
    assert "fills 4 variables" in faults(text)[0]


def test_without_a_vision_project_there_is_no_sequence(failure):
    assert failure("VRun findTip").number == 2543


SAVING = """
Function main
  OnErr GoTo said
  {before}
  VSaveImage findTip, "C:\\{folder}\\tip{suffix}"
  Print FileExists("C:\\{folder}\\tip{suffix}")
  Exit Function
said:
  Print Err
  EResume out
out:
Fend
"""


def saved(vision_cell, before="VRun findTip", folder="none", suffix=".bmp"):
    """Save the picture of a tip at the camera; return the program's output."""
    tip = vision_cell.world.tips[1]
    vision_cell.stand(flange_over(vision_cell.world, tip, 30.0, beside=(1.5, -0.7)))
    vision_cell.load(SAVING.format(before=before, folder=folder, suffix=suffix))
    return vision_cell.run()


def test_a_saved_picture_shows_the_tip_where_it_was_found(vision_cell):
    """A public program saves its pictures like that."""
    made = 'MkDir "C:\\images"; VRun findTip'
    assert saved(vision_cell, made, "images") == ["-1"]
    files = vision_cell.made.runner.session.files
    data = files.path("C:/images/tip.bmp").read_bytes()
    width, height = vision_cell.world.camera.optics.size_px
    kind, size, start = struct.unpack_from("<2sI4xI", data)
    assert (kind, size) == (b"BM", len(data))
    assert struct.unpack_from("<ii", data, 18) == (width, height)
    ((x, y),) = vision_cell.world.see()
    row = start + (height - 1 - round(y)) * width
    assert data[row + round(x)] < 100
    assert data[row + (round(x) + 40) % width] > 100


@pytest.mark.parametrize(
    ("given", "number"),
    [
        ({}, "7213"),
        ({"suffix": ".png"}, "2199"),
        ({"before": "Print 1"}, "7806"),
    ],
)
def test_a_picture_that_cannot_be_saved_is_an_error_of_its_program(vision_cell, given, number):
    assert saved(vision_cell, **given)[-1] == number
