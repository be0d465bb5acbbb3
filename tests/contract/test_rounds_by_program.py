"""A round about the beams is driven by robolink, or by the controller's own program: one verdict.

The same cell with the same seed is measured both ways. What would let a program's round agree and
be wrong is refused: a round that was not driven in Power Low, in another tool, without its run-up,
too fast, or broken off; and a line that is lost moves nothing again.
"""

import math
import re
from dataclasses import replace

import pytest
from robolink_simulators.cell.clock import ManualClock
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.testkit.media import served
from robolink_simulators.testkit.program_calls import AnsweredHere, CallFault

import robolink
from robolink.calibration import Beam
from robolink.errors import CalibrationError, RemoteProtocolError, RobolinkError
from robolink.methods import BeamsParameters, BeamsSource
from robolink.model import EntryKind, Hand, Pose, ToolOffset
from robolink.protocols.spel_callback import CallbackLine, CallbackWord, decode_line, encode_line
from robolink.serving._beam_measure import _require_turned
from robolink.serving._beam_round import read_round, require_promised, round_crossings
from robolink.stations import BeamStation
from tests.contract._sensor_cell import SensorCell
from tests.faults._callback_sensors import (
    BEAM_INPUTS,
    HEADINGS,
    MEASURED_U,
    RoundCell,
    SixAxisRoundCell,
)

ONCE = BeamsParameters(repeats=1, test_turn_deg=90.0, crossing_mm_s=8.0, aside_mm=2.1)
SAME = {"large_drift": "drift"}
soak = pytest.mark.soak


@pytest.fixture
def cells(tmp_path):
    """Make cells of one seed, and close them."""
    made: list[RoundCell] = []

    def make(change=lambda _cell: None, **options):
        folder = tmp_path / str(len(made))
        folder.mkdir()
        cell = RoundCell(folder, in_process=True, **options)
        made.append(cell)
        cell.change_needle()
        change(cell)
        return cell

    yield make
    for cell in made:
        cell.close()


def by_program(cell):
    """Return the code of the program's end, empty if the value was kept."""
    (printed,) = cell.run()
    return "" if printed == "kept" else printed


def by_driver(cell):
    """Change the needle by movements of robolink; return code, and the report."""
    with served(cell.simulator, clock=ManualClock()) as url, robolink.connect(url) as controller:
        change = SensorCell(cell.simulator, url, ManualClock()).change(
            BeamsSource(cell.station, ONCE, sigma_mm=0.01), drift_tolerance_mm=0.1
        )
        try:
            return "", change(controller)
        except RobolinkError as error:
            code = str(getattr(error, "code", "")) or type(error).__name__
            return SAME.get(code, code), None


def moved(mm):
    def move(cell):
        x, y, z = cell.recorded_mm
        cell.stand_at((x + mm, y, z))

    return move


def bent(cell):
    world = cell.simulator.world
    world.set_up(replace(world.parameters, lean_deg=6.0))


def unplugged(cell):
    cell.simulator.world.disconnect(4)


def always_broken(cell):
    cell.simulator.world.disconnect(4)
    cell.simulator.machine.inputs.set(4, on=True)


def test_a_round_by_the_program_finds_what_robolink_finds(cells):
    """The speed of travel, in which the tip goes from side to side, would shift every edge."""
    program, driver = cells(), cells()
    searched: set[float] = set()
    travelled: set[float] = set()
    machine = program.simulator.machine

    def note(_task, file, _number, text):
        if file == "recal.prg" and text.lstrip().startswith("Move "):
            speeds = searched if "Till" in text else travelled
            speeds.add(machine.parameters.speed_s[0])

    program.runner.on_statement = note
    before = program.tool
    code, report = by_driver(driver)
    began_ns = program.simulator.now_ns
    assert (by_program(program), code) == ("", "")
    assert program.simulator.now_ns - began_ns < 11.8e9
    assert program.tool != before
    assert program.error_mm < 0.01
    assert math.dist(program.tool.components()[:2], driver.tool.components()[:2]) < 0.01
    (entry,) = program.entries(EntryKind.CALIBRATION)
    assert len(entry.details["crossings"]) == 4 + 4
    assert entry.details["repeatable_to_mm"] == pytest.approx(
        report.proposal.result.repeatable_to_mm, rel=0.5
    )
    assert entry.details["rounds"] == 2 * [
        {
            "tool": 1,
            "motors_on": True,
            "power_high": False,
            "speed_mm_s": 8.0,
            "acceleration_mm_s2": 200.0,
        }
    ]
    assert (searched, travelled) == ({8.0}, {60.0})
    assert {decode_line(line).fields[4] for line in rounds(program)} == {"8000"}
    assert len(rounds(program)) == 3
    assert max(map(len, program.calls.questions)) <= 255


@pytest.mark.parametrize(
    ("change", "code"),
    [
        pytest.param(moved(0.15), "drift", marks=soak),
        pytest.param(bent, "bent_needle", marks=soak),
        pytest.param(unplugged, "no_edge", marks=soak),
        pytest.param(always_broken, "edge_passed", marks=soak),
    ],
)
def test_what_robolink_refuses_the_program_is_refused(cells, change, code):
    program, driver = cells(change), cells(change)
    old = program.tool
    assert (by_program(program), by_driver(driver)[0]) == (code, code)
    assert program.tool.rounded(3) == driver.tool.rounded(3) == old.rounded(3)
    assert program.open_markers() == []


@soak
def test_six_axes_drive_a_round_too(tmp_path):
    cell = SixAxisRoundCell(tmp_path, in_process=True)
    cell.change_needle()
    assert cell.error_mm > 0.2
    assert by_program(cell) == ""
    assert cell.error_mm < 0.01
    assert max(map(len, cell.calls.questions)) <= 255
    cell.close()


def beams_exchanged(cell):
    """Number the program's points so that its first side crosses the second beam."""
    points = cell.simulator.machine.points
    corners = [points.get(number) for number in range(21, 25)]
    for number, corner in zip(range(21, 25), (corners[0], *corners[:0:-1]), strict=True):
        points.store(number, corner)


@soak
def test_beams_that_were_told_the_wrong_way_round_confirm_no_tip(tmp_path):
    """Taken for the other beam, each pass leads along it: it would say where the square is."""
    first, second = (f"21, {number}" for number in BEAM_INPUTS)
    main = RoundCell.main.replace(f"{first}, {BEAM_INPUTS[1]}", f"{second}, {BEAM_INPUTS[0]}")
    assert main != RoundCell.main
    cell = RoundCell(tmp_path, in_process=True, main=main)
    cell.change_needle()
    beams_exchanged(cell)
    old = cell.tool
    assert by_program(cell) == "no_crossing"
    assert cell.tool.rounded(3) == old.rounded(3)
    cell.close()


def rounds(cell):
    return [line for line in cell.calls.questions if b",ROUND," in line]


def far_beside(cell):
    """Mount a needle that stands in the first beam where the first side begins."""
    normal, turn = cell.station.beams[0].normal, math.radians(-MEASURED_U)
    x, y = (cell.search_mm * way for way in normal)
    c, s = math.cos(turn), math.sin(turn)
    tips, stored = cell.simulator.world.tips, cell.tool
    tips[1] = replace(stored, x_mm=stored.x_mm + c * x - s * y, y_mm=stored.y_mm + s * x + c * y)


def corner(number, axis, value):
    """Change one of the program's points."""

    def change(cell):
        points = cell.simulator.machine.points
        point = points.get(number)
        points.store(
            number, replace(point, hand=value) if axis == "hand" else point.with_axis(axis, value)
        )

    return change


def test_a_round_is_driven_in_low_power_and_leaves_production_as_it_was(tmp_path):
    fast = "  Tool 2\n  Power High\n  Speed 50, 40, 30\n  SpeedS 200, 150, 100\n"
    shown = "  Print Power, Speed(1), Speed(3), SpeedS(1), SpeedS(3), Tool\n"
    main = RoundCell.main.replace("  Tool 1\n", fast)
    main = main.replace("  RobolinkClose\n", f"  RobolinkClose\n{shown}")
    cell = RoundCell(tmp_path, in_process=True, main=main)
    cell.simulator.machine.tools.set(2, ToolOffset(1.0, 2.0, -3.0))
    cell.change_needle()
    moved, machine = [], cell.simulator.machine
    cell.runner.on_statement = lambda _t, file, _n, text: moved.append(
        (machine.robot.power_high, machine.tools.selected)
        if file == "recal.prg" and text.startswith(("Go ", "Move "))
        else None
    )
    assert cell.run() == ["kept", "1", "50", "30", "200", "100", "2"]
    assert set(moved) == {None, (False, 1)}
    cell.close()


@pytest.mark.parametrize("side", [1, 3])
def test_a_speed_that_another_program_set_between_two_sides_tells_no_round(cells, side):
    """What was read before the first side no longer says how the others are crossed."""
    cell, begun, searched = cells(), [], []
    old, machine = cell.tool, cell.simulator.machine

    def interfere(_task, file, _number, text):
        if file == "recal.prg" and "before = Sw(bit)" in text:
            begun.append(text)
        if len(begun) == side and "place3$ = RlPlace$" in text:
            machine.parameters.speed_s = (30.0,) * 3
        searched.append("Till Sw(bit)" in text)

    cell.runner.on_statement = interfere
    assert by_program(cell) == "not_ready"
    assert rounds(cell) == []
    assert cell.tool.rounded(3) == old.rounded(3)
    assert sum(searched) == 2 * side, "nothing is searched at that speed"


def in_a_local(cell):
    points = cell.simulator.machine.points
    for number in range(21, 25):
        points.store(number, replace(points.get(number), local=1))


def motors_off(cell):
    cell.simulator.machine.switch_all_motors(False)


@pytest.mark.parametrize(
    "change",
    [
        corner(23, "Z", -105.0),
        pytest.param(corner(24, "U", 25.0), marks=soak),
        pytest.param(corner(22, "X", 190.0), marks=soak),
        pytest.param(corner(22, "hand", Hand.LEFT), marks=soak),
        pytest.param(motors_off, marks=soak),
    ],
)
def test_a_program_that_is_not_ready_moves_nothing(cells, change):
    cell = cells(change)
    there = cell.simulator.machine.arm.flange()
    assert by_program(cell) == "not_ready"
    assert cell.simulator.machine.arm.flange() == there
    assert rounds(cell) == []


@soak
def test_points_in_a_local_are_found_out_above_the_beams(cells):
    """Their numbers are those of another place; the robot is there, but lifted."""
    local = "  Tool 1\n  Local 1, XY(10, 0, 0, 0)\n"
    cell, heights = cells(in_a_local, main=RoundCell.main.replace("  Tool 1\n", local)), []
    cell.runner.on_statement = lambda *_: heights.append(cell.simulator.machine.arm.flange().z_mm)
    assert by_program(cell) == "not_ready"
    assert min(heights) == heights[0]
    assert rounds(cell) == []


@soak
@pytest.mark.parametrize(
    ("change", "searches"),
    [pytest.param(unplugged, 3, id="dark"), pytest.param(far_beside, 0, id="broken")],
)
def test_nothing_is_searched_where_an_edge_is_missing(cells, change, searches):
    """What a condition does that holds from the start is not documented."""
    cell, driven = cells(change), []
    cell.runner.on_statement = lambda _t, _f, _n, text: driven.append("Till Sw(bit)" in text)
    assert by_program(cell) in {"no_edge", "edge_passed"}
    assert sum(driven) == searches


@soak
def test_a_robot_that_does_not_stay_level_tells_no_round(cells):
    cell = cells(options=EpsonOptions(real_pos_noise_mm=0.015))
    assert by_program(cell) == "not_ready"
    assert rounds(cell) == []


class Altered(AnsweredHere):
    """Answers rounds of which one field is another."""

    def __init__(self, answers, number, field):
        super().__init__(answers)
        self._number, self._field = number, field

    def ask(self, question):
        line = decode_line(question)
        if line.word is CallbackWord.ROUND:
            fields = [*line.fields]
            fields[self._number] = self._field
            question = encode_line(replace(line, fields=tuple(fields))).removesuffix(b"\r\n")
        return super().ask(question)


@pytest.mark.parametrize(
    ("number", "field", "code"),
    [
        pytest.param(3, "1", "not_low_power", id="power", marks=soak),
        pytest.param(1, "2", "tool_pose", id="tool", marks=soak),
    ],
)
def test_a_round_that_was_driven_otherwise_is_refused(cells, number, field, code):
    cell = cells()
    cell.calls.far = lambda: Altered(cell.conversation("the program"), number, field)
    assert by_program(cell) == code
    assert len(rounds(cell)) == 1


@soak
def test_nothing_is_driven_that_was_not_begun(tmp_path):
    main = RoundCell.main.replace('RobolinkBegin(1, "beams@gate")', "rl_robot = 1")
    main = main.replace(
        "  RobolinkRestore\n", "  RobolinkRestore\n  rl_robot = 1\n  rl_tool = 1\n", 1
    )
    cell = RoundCell(tmp_path, in_process=True, main=main)
    cell.change_needle()
    there = cell.simulator.machine.arm.flange()
    cell.run()
    assert cell.simulator.machine.arm.flange() == there
    assert rounds(cell) == []
    cell.close()


def lost(number, fault):
    """Plan a fault for one of the rounds."""

    def change(cell):
        seen = []

        def of(_number, line):
            if b",ROUND," not in line:
                return None
            seen.append(line)
            return fault if len(seen) == number else None

        cell.calls.fault = of

    return change


@pytest.mark.parametrize(
    ("number", "fault"),
    [
        pytest.param(1, CallFault(drop_answer=True), marks=soak),
        pytest.param(2, CallFault(cut_before=True), marks=soak),
        (3, CallFault(drop_answer=True)),
        pytest.param(3, CallFault(bend_question=True), marks=soak),
        pytest.param(3, CallFault(cut_after=True), marks=soak),
    ],
)
def test_a_round_whose_line_is_lost_is_not_driven_again(cells, number, fault):
    cell, driven = cells(lost(number, fault)), []
    old = cell.tool
    cell.runner.on_statement = lambda _t, _f, _n, text: driven.append(text)
    assert by_program(cell) != ""
    # Set before each of the four sides of a round.
    assert sum("SpeedS" in text and text.endswith(" 8") for text in driven) == 4 * number
    assert len(rounds(cell)) == number
    assert cell.tool.rounded(3) == old.rounded(3)
    flange = cell.simulator.machine.arm.flange()
    lift_mm = flange.z_mm + cell.tool.z_mm - cell.recorded_mm[2]
    assert lift_mm > 10


@soak
@pytest.mark.parametrize("nth", [1, 3, 8, 9, 16, 20])
def test_power_that_fails_in_a_round_leaves_the_old_tool(cells, nth):
    """Nothing of the round is driven when the program starts again: only the tool is put back."""
    cell = cells()
    old = cell.tool
    at = [
        number
        for number, (_file, _line, text) in enumerate(cell.statements())
        if "Till Sw(bit)" in text
    ]
    again = cells()
    assert again.run_until(at[nth - 1]) is not None
    begun = len(rounds(again))
    again.restore()
    assert again.tool.rounded(3) == old.rounded(3)
    assert len(rounds(again)) == begun


@soak
def test_a_servo_that_lags_behind_shifts_no_edge(cells):
    """A movement that an input has ended does not wait until the arm is at rest."""
    cell = cells(options=EpsonOptions(servo_lag_ms=10.0))
    assert by_program(cell) == ""
    assert cell.error_mm < 0.01


@soak
@pytest.mark.parametrize("nth", [1, 8, 9, 17, 24])
def test_an_emergency_stop_in_a_round_ends_it_where_the_robot_is(cells, nth):
    cell, begun = cells(), []
    old, simulator = cell.tool, cell.simulator
    cell.runner.on_statement = lambda _t, _f, _n, text: begun.append("Till Sw(bit)" in text)
    cell.start()
    while sum(begun) < nth:
        simulator.advance(simulator.next_change())
    simulator.panel.press_estop()
    there, asked = simulator.machine.arm.flange(), len(cell.calls.questions)
    simulator.advance(simulator.now_ns + 30 * 10**9)
    assert simulator.machine.arm.flange() == there
    assert len(cell.calls.questions) == asked
    cell.lose_power()
    cell.restore()
    assert cell.tool.rounded(3) == old.rounded(3)


SQUARE = ("0", "1", "1", "0", "8000", "200", "298000", "78000", "-60000", "20000", "0", "0")
SIDES = (
    *("032", "0", "1500", "0", "2500", "0", "4000"),
    *("032", "1500", "4000", "2500", "4000", "4000", "4000"),
    *("032", "4000", "2500", "4000", "1500", "4000", "0"),
    *("032", "2500", "0", "1500", "0"),
)
STATION = BeamStation(
    (Beam(300.0, 80.0, HEADINGS[0]), Beam(300.0, 80.0, HEADINGS[1])), -60.0, inputs=(3, 4)
)


def told(*, state=SQUARE, sides=SIDES, **changed):
    state = [changed.get(f"f{number}", field) for number, field in enumerate(state)]
    driven = read_round([*state, *sides])
    require_promised(driven)
    return round_crossings(driven, changed.get("station", STATION))


def test_a_round_says_where_each_edge_was():
    crossings = told()
    assert [one.beam for one in crossings] == [0, 1, 0, 1]
    assert (crossings[1].entry.x_mm, crossings[1].exit.y_mm) == (299.5, 82.0)
    assert crossings[3].exit.tool == 1


@pytest.mark.parametrize(
    ("changed", "code"),
    [
        ({"f2": "0"}, "not_low_power"),
        ({"f3": "1"}, "not_low_power"),
        ({"f4": "20001"}, "crossing_speed"),
        ({"f4": "400"}, "crossing_speed"),
        ({"f5": "0"}, None),
        ({"f5": "20"}, "run_up_too_short"),
        ({"station": replace(STATION, off_when_broken=True)}, "edge_passed"),
        ({"sides": ("100", "0", "0", "0", "0")}, "edge_passed"),
        ({"sides": ("000", "0", "0", "0", "0")}, "no_edge"),
        ({"sides": ("020", "0", "0", "0", "0")}, "edge_passed"),
        ({"sides": (*SIDES[:7], "030", "1500", "4000", "4000", "4000")}, "no_edge"),
        ({"sides": (*SIDES[:7], "033", "1500", "4000", "4000", "4000")}, "edge_passed"),
        ({"sides": (*SIDES[:5], "0", "4000", *SIDES[7:14], "032", "4000", "4000", "1", "1")}, None),
    ],
)
def test_a_round_that_shows_nothing_is_refused(changed, code):
    refused = RemoteProtocolError if code is None else CalibrationError
    with pytest.raises(refused) as raised:
        told(**changed)
    assert getattr(raised.value, "code", None) == code


@pytest.mark.parametrize(
    "fields",
    [
        SQUARE,
        (*SQUARE, *SIDES, "0"),
        (*SQUARE, *SIDES, *SIDES[-7:]),
        (*SQUARE, *SIDES[:5]),
        (*SQUARE, "042", *SIDES[1:]),
        ("2", *SQUARE[1:], *SIDES),
        (*SQUARE[:5], "-200", *SQUARE[6:], *SIDES),
    ],
)
def test_a_line_that_is_no_round_is_not_understood(fields):
    with pytest.raises(RemoteProtocolError):
        read_round(fields)


def test_the_longest_round_fits_into_a_text_of_the_controller():
    """A longer one would end the program with the tip low between the beams."""
    place = ("-1999999", "-1999999", "-1999999", "-359999", "-179999", "-179999")
    state = ("1", "15", "1", "0", "8000", "25000", *place)
    sides = tuple(field if re.fullmatch("0..", field) else "-9899" for field in SIDES)
    line = encode_line(CallbackLine(99, CallbackWord.ROUND, (*state, *sides)))
    assert len(line) <= 255 + 2


def test_beams_are_tested_sixty_degrees_or_more_from_every_angle_of_the_measurement():
    measured = [Pose(300.0, 100.0, -80.0, 0.0), Pose(300.0, 100.0, -80.0, -170.0)]
    _require_turned([Pose(300.0, 100.0, -80.0, 60.0)], measured)
    with pytest.raises(CalibrationError) as raised:
        _require_turned([Pose(300.0, 100.0, -80.0, 59.9)], measured)
    assert raised.value.code == "insufficient_rotation"
