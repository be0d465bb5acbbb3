"""``calibrate`` and ``impact`` with existing poses: nothing ever moves."""

import json
import os
from dataclasses import replace

import pytest
from robolink_cli import main
from robolink_cli.commands.measure.calibrate import given_poses
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.epson.memory.points import Point

import robolink
from robolink.errors import CalibrationError
from robolink.methods import PointsSource
from robolink.model import EntryKind, Hand, Pose, ToolOffset, rotate_xy

REAL = ToolOffset(12.3, -3.9, -20.4)

STORED = ToolOffset(12.0, -3.5, -20.0)
"""The initial tool 1 of a simulator."""

PIN = (300.0, 100.0, -60.0)


def touching(u_deg, believed=None, **more):
    """Return a point taught on the pin with a tool that is believed to be there."""
    own = believed or ToolOffset()
    x, y = rotate_xy(REAL.x_mm - own.x_mm, REAL.y_mm - own.y_mm, u_deg)
    return Pose(PIN[0] - x, PIN[1] - y, PIN[2] - REAL.z_mm + own.z_mm, u_deg, **more)


POSES = (touching(10), touching(-170))


@pytest.fixture(autouse=True)
def plain_environment(monkeypatch):
    for name in [name for name in os.environ if name.startswith("ROBOLINK")]:
        if name != "ROBOLINK_STATE_DIR":
            monkeypatch.delenv(name)


@pytest.fixture
def simulator():
    simulator = EpsonSimulator(seed=7)
    store = simulator.machine.points.store
    store(901, Point.at(touching(10)))
    store(902, Point.at(touching(-170)))
    store(911, Point.at(touching(10, STORED)))
    store(912, Point.at(touching(-170, STORED)))
    store(921, Point.at(touching(-170, hand=Hand.LEFT)))
    store(931, Point(touching(-170).coordinates(), local=2))
    store(941, Point((300.0, 100.0, 0.0, 0.0, 0.0, 180.0)))
    store(951, Point.at(touching(30)))
    store(1, Point.at(Pose(250, 200, -30, 0)))
    store(3, Point.at(Pose(250, 210, -30, 90)))
    store(4, Point((1.0, 2.0, 3.0, 4.0, 0.0, 0.0), local=5))
    return simulator


@pytest.fixture
def command(serve, simulator, capsys):
    """Run a command line on the cell; return its exit code, stdout and stderr."""
    with serve(simulator) as cell:
        capsys.readouterr()

        def run(*words):
            code = main.run(["-c", cell.url, *words])
            shown = capsys.readouterr()
            return code, shown.out, shown.err

        run.url = cell.url  # type: ignore[attr-defined]
        yield run
    arm = simulator.machine.arm
    assert arm.moves_started == 0
    assert simulator.machine.tools.selected == 1


def stored(simulator):
    return simulator.machine.tools.defined()[1]


def calibrate(*more):
    return ("calibrate", "two-pose", "--tool", "1", *more)


@pytest.mark.on_every_link
def test_taught_points_give_the_tip_and_what_was_not_measured_is_kept(command, simulator):
    code, out, _ = command(*calibrate("--points", "901,902", "--yes"))
    assert code == 0
    assert stored(simulator) == ToolOffset(12.3, -3.9, -20.0)
    assert "Z -20.000: not measured, stays" in out
    assert "Written. The controller has stored tool 1." in out
    assert "Not tested yet. To test:" in out


@pytest.mark.parametrize("layout", ["json", "csv"])
def test_a_file_of_poses_gives_the_same(command, simulator, tmp_path, layout):
    poses = [touching(10), touching(-170)]
    path = tmp_path / f"poses.{layout}"
    rows = [{"x_mm": p.x_mm, "y_mm": p.y_mm, "u_deg": p.u_deg} for p in poses]
    text = "\n".join(",".join(map(str, row.values())) for row in rows)
    path.write_text(json.dumps(rows) if layout == "json" else f"x_mm,y_mm,u_deg\n{text}\n")
    assert command(*calibrate("--poses", str(path), "--yes"))[0] == 0
    assert stored(simulator) == ToolOffset(12.3, -3.9, -20.0)


def test_typed_poses_may_be_negative(command, simulator):
    first, second = touching(10), touching(-170)
    shift = 600.0
    words = [f"{p.x_mm - shift:.3f},{p.y_mm:.3f},{p.u_deg}" for p in (first, second)]
    assert words[0].startswith("-")
    code, _, _ = command(*calibrate("--pose", words[0], "--pose", words[1], "--yes"))
    assert code == 0
    assert stored(simulator).matches(ToolOffset(12.3, -3.9, -20.0), 0.002)


def test_the_document_has_the_shape_of_a_live_one_and_names_its_source(command):
    code, out, err = command(*calibrate("--points", "901,902", "--yes", "--json"))
    document = json.loads(out)
    assert code == 0
    assert document["schema"] == "robolink/calibration/1"
    assert document["source"] == {"kind": "points", "taught_tool": 0, "points": [901, 902]}
    assert document["proposed"]["x_mm"] == pytest.approx(12.3, abs=1e-3)
    assert document["kept"] == ["z_mm", "u_deg", "v_deg", "w_deg"]
    assert document["write"]["read_back"]["y_mm"] == -3.9
    assert document["verification"] is None
    assert document["impact"] is None
    assert document["better_tool"] is None
    assert "measured" in err


@pytest.mark.parametrize(
    ("points", "more", "first", "tool"),
    [
        ("901,902", (), 12.3, 0),
        ("901,902,951", ("--method", "n-angle"), 12.3, 0),
        ("911,912", ("--taught-tool", "1"), 12.3, 1),
    ],
)
def test_points_are_a_method_of_their_own(command, simulator, points, more, first, tool):
    words = ("calibrate", "points", "--tool", "1", "--points", points, *more, "--yes", "--json")
    code, out, err = command(*words)
    assert code == 0, err
    document = json.loads(out)
    assert document["method"] == "points"
    assert document["source"]["taught_tool"] == tool
    assert document["proposed"]["x_mm"] == pytest.approx(first, abs=1e-3)
    assert len(document["poses"]) == len(points.split(","))
    assert stored(simulator).matches(ToolOffset(12.3, -3.9, -20.0), 0.002)


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        ((), 2, "--points is missing"),
        (("--points", "901,902", "--speed", "5"), 2, "--speed is for movements"),
        (("--points", "901,902,951"), 2, "--points: must hold two points; more are for"),
        (("--points", "901,902", "--method", "n-angle"), 2, "--points: must hold three points"),
        (("--points", "901,902", "--pose", "1,2,3"), 2, "No option --"),
    ],
)
def test_the_method_points_takes_points_and_nothing_else(command, simulator, words, code, said):
    ended, _, err = command("calibrate", "points", "--tool", "1", *words, "--yes")
    assert ended == code, err
    assert said in err
    assert stored(simulator) == STORED


def test_off_a_terminal_nothing_is_written_without_yes(command, simulator):
    code, out, err = command(*calibrate("--points", "901,902"))
    assert code == 9
    assert "12.300" in out
    assert "--yes" in err
    assert stored(simulator) == STORED


def test_on_a_terminal_a_no_writes_nothing(command, simulator, monkeypatch):
    asked = []

    def decline(question, *, yes):
        asked.append(question)
        raise robolink.errors.DeclinedError("You said no.")

    monkeypatch.setattr(given_poses, "person_here", lambda: True)
    monkeypatch.setattr(given_poses, "agree", decline)
    assert command(*calibrate("--points", "901,902", "--axes-held"))[0] == 9
    (question,) = asked
    assert "Write it to tool 1 anyway?" in question
    assert "did not see these touches" in question
    assert stored(simulator) == STORED


class AtTerminal:
    """Confirms everything except the questions with answers of their own."""

    def __init__(self, **otherwise):
        self.asked, self._otherwise = [], otherwise

    def tell(self, text):
        """Accept a message."""

    def ask(self, question, kind):
        self.asked.append(question)

    def poll(self, wait_s):
        return self._otherwise.get("held", "y") if "SFREE" in self.asked[-1] else "y"


@pytest.mark.parametrize(
    "given",
    [("--points", "901,902"),
     ("--pose", "287.7,103.9,-39.6,0", "--pose", "312.3,96.1,-39.6,180")],
)  # fmt: skip
def test_whether_axes_were_held_is_asked_once_and_on_record(command, simulator, monkeypatch, given):
    person = AtTerminal()
    monkeypatch.setattr("robolink_cli.prompts.operator._plain_terminal", lambda: person)
    monkeypatch.setattr(given_poses, "person_here", lambda: True)
    monkeypatch.setattr("robolink_cli.prompts.questions.person_here", lambda: True)
    monkeypatch.setattr("robolink_cli.session.motion_consent.person_here", lambda: True)
    code, out, err = command(*calibrate(*given, "--json"))
    assert code == 0, err
    assert [one for one in person.asked if "SFREE" in one] == [
        "Were all axes held by their motors (not SFREE) when these poses were taught?"
    ]
    assert "axes_not_confirmed" not in json.loads(out)["fit"]["notes"]
    (said,) = [one for one in decisions(command) if "SFREE" in one["question"]]
    assert (said["answer"], said["answered_by"]) == ("yes", "person")


def decisions(command):
    with robolink.connect(command.url) as controller:
        entries = controller.outcomes.recorded(kinds=(EntryKind.DECISION,))
        return [one.details for one in entries if "question" in one.details]


def test_poses_taught_with_axes_let_go_are_refused(command, simulator, monkeypatch):
    person = AtTerminal(held="n")
    monkeypatch.setattr("robolink_cli.prompts.operator._plain_terminal", lambda: person)
    monkeypatch.setattr(given_poses, "person_here", lambda: True)
    code, out, _ = command(*calibrate("--points", "901,902", "--json"))
    assert code == 7
    assert json.loads(out)["error"]["code"] == "axes_free"
    assert stored(simulator) == STORED


def test_with_yes_alone_it_is_a_note_that_names_the_option(command, simulator):
    code, out, err = command(*calibrate("--points", "901,902", "--yes", "--json"))
    assert code == 0, err
    assert "axes_not_confirmed" in json.loads(out)["fit"]["notes"]
    assert "To confirm it: --axes-held" in err
    assert not [one for one in decisions(command) if "SFREE" in one["question"]]
    with_it = calibrate("--points", "911,912", "--taught-tool", "1", "--yes", "--json")
    code, out, err = command(*with_it, "--axes-held")
    assert code == 0, err
    assert "axes_not_confirmed" not in json.loads(out)["fit"]["notes"]
    (said,) = [one for one in decisions(command) if "SFREE" in one["question"]]
    assert (said["answer"], said["answered_by"]) == ("yes", "option")


def test_axes_held_belongs_to_poses_that_exist(command):
    code, _, err = command(*calibrate("--axes-held"))
    assert code == 2
    assert "--axes-held need existing poses" in err


def test_a_dry_run_shows_the_request_and_writes_nothing(command, simulator):
    code, out, _ = command(*calibrate("--points", "901,902", "--dry-run"))
    assert code == 0
    assert '$Execute,"TLSet 1, XY(12.300, -3.900, -20.000, 0.000)"' in out
    assert stored(simulator) == STORED
    code, out, _ = command(*calibrate("--points", "901,902", "--dry-run", "--json"))
    assert code == 0
    assert json.loads(out)["requests"] == ['$Execute,"TLSet 1, XY(12.300, -3.900, -20.000, 0.000)"']


def test_points_taught_with_a_tool_are_seen_through_its_stored_value(command, simulator):
    code, _, err = command(*calibrate("--points", "911,912", "--taught-tool", "1", "--yes"))
    assert code == 0
    assert "Warning" not in err
    assert stored(simulator) == ToolOffset(12.3, -3.9, -20.0)


@pytest.mark.parametrize(
    ("points", "said", "meant"), [("911,912", "0", "1"), ("901,902", "1", "0")]
)
def test_the_wrong_tool_is_warned_of_and_its_change_refused(
    command, simulator, points, said, meant
):
    words = calibrate("--points", points, "--taught-tool", said, "--yes")
    code, _, err = command(*words)
    assert code == 7
    assert f"fit tool {meant} much better than tool {said}" in err
    assert f"--taught-tool {meant}" in err
    assert stored(simulator) == STORED
    code, out, _ = command(*words, "--max-change", "50", "--json")
    assert code == 0
    assert json.loads(out)["better_tool"] == int(meant)
    assert json.loads(out)["warnings"] == ["other_tool_fits"]
    assert json.loads(out)["tool_fits"][0]["tool"] == int(meant)


REFUSED = {
    "too_few_poses": ("--points", "901"),
    "undefined_point": ("--points", "901,990"),
    "mixed_hand": ("--points", "901,921"),
    "mixed_local": ("--points", "901,931"),
    "tilted_pose": ("--points", "901,941"),
    "insufficient_rotation": ("--points", "901,951"),
    "degenerate_angles": ("--pose", "300,100,0", "--pose", "310,100,360"),
    "non_finite": ("--pose", "nan,100,0", "--pose", "310,100,180"),
    "suspect_units": ("--pose", "0.3,0.1,0", "--pose", "0.31,0.1,180"),
    "implausible_change": ("--pose", "300,100,0", "--pose", "310,100,180"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_bad_poses_end_with_their_named_code(command, simulator, name):
    code, out, _ = command(*calibrate(*REFUSED[name], "--yes", "--json"))
    assert code == 7
    assert json.loads(out)["error"]["code"] == name
    assert json.loads(out)["error"]["remedy"]
    assert stored(simulator) == STORED


@pytest.mark.parametrize(
    "words",
    [
        ("--points", "901,902", "--pose", "1,2,3"),
        ("--points", "901,902", "--poses", "x.json"),
        ("--points", "901,902,921"),
        ("--points", "902-901"),
        ("--points", "901,9020"),
        ("--pose", "300,100"),
        ("--pose", "300,100,abc"),
        ("--poses", "missing.json"),
        ("--points", "901,902", "--lift", "12"),
        ("--points", "901,902", "--no-verify"),
        ("--points", "901,902", "--assist", "assist+tcp://127.0.0.1:1"),
        ("--taught-tool", "1"),
        ("--points", "901,902", "--impact", "1-5", "--impact-pts", "robot1.pts"),
        ("--dry-run", "--impact", "1-5"),
    ],
)
def test_what_makes_no_sense_together_is_a_mistake_in_the_command(command, simulator, words):
    code, _, err = command(*calibrate(*words, "--yes"))
    assert code == 2
    assert "Traceback" not in err
    assert stored(simulator) == STORED


def test_an_undefined_taught_tool_is_refused(command):
    code, _, err = command(*calibrate("--points", "901,902", "--taught-tool", "9", "--yes"))
    assert code == 5
    assert "Tool 9 is not defined" in err


@pytest.mark.on_every_link
def test_a_tool_changed_meanwhile_is_not_overwritten(command, simulator, monkeypatch):
    def change(tool, *, yes):
        simulator.machine.tools.set(1, ToolOffset(1, 2, 3))

    monkeypatch.setattr(given_poses, "_agree_to_write", change)
    code, _, err = command(*calibrate("--points", "901,902", "--yes"))
    assert code == 5
    assert "nothing was written" in err
    assert stored(simulator) == ToolOffset(1, 2, 3)


@pytest.mark.on_every_link
def test_the_impact_is_shown_before_the_question(command):
    code, out, _ = command(*calibrate("--points", "901,902", "--impact", "1-5"))
    assert code == 9
    assert "at every point: 0.500 mm" in out
    assert "not taught, skipped: 2" in out
    assert "P4 (local 5)" in out


def test_an_undefined_tool_has_no_impact(command):
    words = ("calibrate", "two-pose", "--tool", "6", "--points", "901,902", "--impact", "1-5")
    code, out, _ = command(*words, "--yes", "--json")
    assert code == 0
    assert json.loads(out)["impact"] is None
    assert json.loads(out)["before"] is None


def test_the_impact_of_a_typed_offset_is_shown_and_nothing_written(command, simulator):
    words = ("impact", "--tool", "1", "--x", "12.3", "--y", "-3.9", "--points", "1-5")
    code, out, _ = command(*words, "--json")
    document = json.loads(out)
    assert code == 0
    assert document["schema"] == "robolink/impact/1"
    first, third = document["points"]
    assert (first["dx_mm"], first["dy_mm"]) == pytest.approx((-0.3, 0.4))
    assert (third["dx_mm"], third["dy_mm"]) == pytest.approx((-0.4, -0.3))
    assert document["largest_mm"] == pytest.approx(0.5)
    assert document["undefined_count"] == 2
    assert document["other_local"] == [{"point": 4, "local": 5}]
    code, out, _ = command(*words)
    assert code == 0
    assert "Nothing was written." in out
    assert stored(simulator) == STORED


def test_a_point_file_stands_in_for_the_controllers_points(command, tmp_path):
    path = tmp_path / "robot1.pts"
    fields = "\n".join(
        f"\tr{axis}={value}" for axis, value in zip("XYZUVW", (9, 8, 7, 90, 0, 0), strict=True)
    )
    path.write_text(
        f"nNumberOfPoints=1\nPoint1 {{\n\tnNumber=12\n\tnUndefined=448\n{fields}\n"
        "\tnLocal=0\n\tnHand=1\n}\n"
    )
    code, out, _ = command("impact", "--tool", "1", "--x", "13", "--pts", str(path), "--json")
    assert code == 0
    (entry,) = json.loads(out)["points"]
    assert entry["point"] == 12
    assert (entry["dx_mm"], entry["dy_mm"]) == pytest.approx((0, -1))


@pytest.mark.parametrize(
    ("words", "code"),
    [
        (("--tool", "1", "--x", "12"), 2),
        (("--tool", "1", "--points", "1-5"), 2),
        (("--tool", "1", "--x", "nan", "--points", "1-5"), 2),
        (("--tool", "1", "--x", "12", "--points", "1-5", "--pts", "a.pts"), 2),
        (("--tool", "1", "--x", "12", "--pts", "missing.pts"), 2),
        (("--tool", "16", "--x", "12", "--points", "1"), 2),
        (("--tool", "7", "--x", "12", "--points", "1"), 5),
    ],
)
def test_an_impact_that_cannot_be_shown_says_why(command, words, code):
    found, _, err = command("impact", *words)
    assert found == code
    assert "Traceback" not in err


def test_points_at_two_heights_are_refused_and_others_say_that_nobody_saw_them(command, simulator):
    low = touching(-170)
    simulator.machine.points.store(903, Point.at(Pose(low.x_mm, low.y_mm, low.z_mm - 50, -170)))
    code, _, err = command(*calibrate("--points", "901,903", "--yes"))
    assert code == 7
    assert "Heights differ by 50.00 mm on one pin" in err
    assert stored(simulator) == STORED
    code, out, _ = command(*calibrate("--points", "901,902", "--yes", "--json"))
    assert code == 0
    assert "touches_not_witnessed" in json.loads(out)["fit"]["notes"]


@pytest.mark.fault("F39")
@pytest.mark.parametrize("tool", ["1", "5"])
def test_poses_in_inches_are_refused_by_where_the_robot_is(command, simulator, tmp_path, tool):
    """The length of tool 5 cannot show it: the tool is undefined."""
    path = tmp_path / "poses.csv"
    rows = [f"{p.x_mm / 25.4:.5f},{p.y_mm / 25.4:.5f},{p.u_deg}" for p in POSES]
    path.write_text("\n".join(["x_mm,y_mm,u_deg", *rows]))
    before = dict(simulator.machine.tools.defined())
    words = ("calibrate", "two-pose", "--tool", tool, "--max-change", "50", "--yes", "--json")
    code, out, _ = command(*words, "--poses", str(path))
    assert (code, json.loads(out)["error"]["code"]) == (7, "suspect_units")
    typed = [word for row in rows for word in ("--pose", row)]
    code, out, _ = command(*words, *typed)
    assert (code, json.loads(out)["error"]["code"]) == (7, "suspect_units")
    assert simulator.machine.tools.defined() == before


@pytest.mark.fault("F39")
def test_poses_in_inches_are_refused_by_the_length_of_the_stored_tool(serve, simulator):
    """In a local system positions cannot show it; the controller's own points are in mm anyway."""
    inches = [replace(p, x_mm=p.x_mm / 25.4, y_mm=p.y_mm / 25.4, local=2) for p in POSES]
    with serve(simulator) as cell, robolink.connect(cell.url) as controller:
        with pytest.raises(CalibrationError) as refused:
            PointsSource(lambda: inches).find(controller, 1, STORED)
        assert refused.value.code == "suspect_units"
        found = PointsSource(lambda: inches, in_mm=True).find(controller, 1, STORED)
        assert found.result.offset.x_mm == pytest.approx(REAL.x_mm / 25.4, abs=1e-6)


def test_a_pin_that_was_touched_in_a_local_is_not_kept_as_one_of_the_base(command, simulator):
    store = simulator.machine.points.store
    store(932, Point(touching(10).coordinates(), local=2))
    words = ("calibrate", "two-pose", "--tool", "1", "--points", "931,932", "--yes", "--json")
    for more in ((), ("--dry-run",)):
        code, out, _ = command(*words, "--station", "PIN-07", *more)
        assert (code, json.loads(out)["error"]["code"]) == (7, "local_pose")
        assert stored(simulator) == STORED
    assert "PIN-07" not in command("station", "list", "--json")[1]
    assert command(*words)[0] == 0
    assert stored(simulator) == ToolOffset(12.3, -3.9, -20.0)


def test_that_nobody_saw_the_touches_is_said_though_yes_was_said_beforehand(command, simulator):
    code, out, err = command(*calibrate("--points", "901,902", "--yes"))
    assert code == 0
    assert "not seen by robolink" in out
    assert "Not tested yet" in out + err
    assert "verified" not in out + err
    assert stored(simulator) != STORED


BUMPED = (*((u, 0.0) for u in (0, 180, 90, -90)), *((u, 0.15) for u in (45, -135, 135, -45)))
"""The pin was pushed 0.15 mm between the fourth and the fifth touch."""


def bumped_file(folder, step_mm):
    """Write touches with a scatter of some micrometres and the pin pushed by ``step_mm``."""
    errors = (0.004, -0.003, 0.002, -0.005, 0.003, 0.001, -0.004, 0.002)
    path = folder / "poses.csv"
    lines = ["x_mm,y_mm,z_mm,u_deg"]
    for (u, pushed), error in zip(BUMPED, errors, strict=True):
        pose = touching(u)
        x_mm = pose.x_mm + step_mm * (pushed > 0) + error
        lines.append(f"{x_mm:.3f},{pose.y_mm - error:.3f},{pose.z_mm:.3f},{u}")
    path.write_text("\n".join(lines))
    return str(path)


def test_touches_between_which_the_pin_moved_are_not_written_while_nobody_is_asked(
    command, simulator, tmp_path
):
    before = stored(simulator)
    words = ("calibrate", "n-angle", "--tool", "1", "--poses")
    code, out, _ = command(*words, bumped_file(tmp_path, 0.15), "--yes", "--json")
    assert (code, json.loads(out)["error"]["code"]) == (7, "step_in_run_order")
    assert json.loads(out)["error"]["what"] == ("Between touch 4 and 5 something moved by 0.15 mm.")
    assert stored(simulator) == before
    code, out, _ = command(*words, bumped_file(tmp_path, 0.0), "--yes", "--json")
    assert code == 0, out
    assert stored(simulator) != before
