"""Messages to a person at the screen, and the absence of effects of ENTER and early keys."""

import shutil
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import click
import pytest
from robolink_cli import main
from robolink_cli.commands.measure import run_events
from robolink_cli.commands.measure.recalibrate import _chosen_anew, steps_of
from robolink_cli.commands.measure.recipe_choice import _rows_of, choose_recipe
from robolink_cli.options.shared import GIVEN, TYPED
from robolink_cli.prompts.current_desk import sitting_at
from robolink_cli.session.check_before_start import check_before_start
from robolink_cli.session.context import context_of_cell
from robolink_cli.wizard.glance import ControllerGlance
from robolink_cli.wizard.happenings import Reading, WasAsked, WasRegarded, WasTold
from robolink_cli.wizard.screens.layout import status_row, title_row
from robolink_cli.wizard.screens.screen import screen_of
from robolink_cli.wizard.screens.sentences import told_before
from robolink_cli.wizard.state import (
    CheckPoint,
    CheckSubject,
    ChoiceSubject,
    Header,
    Mark,
    WizardState,
)
from robolink_cli.wizard.views.frame import JobStep, head_of, status_of
from robolink_cli.wizard.work import Desk
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.fieldbus.modbus import serve_modbus_tcp
from robolink_simulators.hosting.in_process.epson import simulator_named, unregister
from robolink_simulators.hosting.streams.epson import serve_tcp
from robolink_simulators.softmotion.mailbox.simulator import SoftMotionSimulator

import robolink
from robolink.backup import keep_first_backup, load, save
from robolink.calibration_run import ChangeReport, Moment
from robolink.config import find_cell
from robolink.errors import ConfigError, DeclinedError, NotReadyError
from robolink.journal import memory_journal, open_log
from robolink.model import EntryKind, NewEntry, Pose, Signature, ToolOffset, describe_offset
from robolink.model import Path as Way
from robolink.recipe import load_recipe
from robolink.runner import MoveSubject, Question
from robolink.stations import StationKind
from robolink.timing import local_label
from robolink.transaction import Wanted, change_tools
from tests.cli.wizard._people import HEADER, Sitting, touch_subject, write_subject

RECIPES = Path(__file__).parents[3] / "examples" / "recipes"

OLD_OR_NEW = ChoiceSubject("Recover", (), ("The old one.", "The new one."), None, enters=False)


def test_enter_does_not_do_what_a_marked_row_of_a_recovery_says():
    hand = Sitting().asked(OLD_OR_NEW, Question.TEXT).keys("2").key("enter")
    assert hand.sent == [], "it would write"
    assert "ENTER does nothing here" in hand.state.message
    assert hand.keys("5").sent == ["1"]
    cells = replace(OLD_OR_NEW, enters=True)
    assert Sitting().asked(cells, Question.TEXT).keys("2").key("enter").sent == ["1"]


def asked_for_an_id():
    hand = Sitting().happens(WasRegarded(None))
    return hand.happens(WasAsked(1, "Id?", Question.TEXT, hand.now)).waits()


@pytest.mark.parametrize("first_s", [0.0, 0.1, 0.29])
def test_a_code_that_begins_before_its_field_could_be_seen_is_dropped_whole(first_s):
    hand = asked_for_an_id()
    hand.now += first_s
    for key in (*"N-0418", "enter"):
        hand.key(key, key if len(key) == 1 else "")
        hand.now += 0.03
    assert hand.sent == [], hand.state.typed
    assert hand.state.typed == ""
    assert "Typed too early" in hand.state.message
    hand.now += 0.31
    for key in (*"N-0418", "enter", "enter"):
        hand.key(key, key if len(key) == 1 else "")
        hand.now += 0.03
    assert hand.sent == ["N-0418"]
    assert hand.state.message == ""


def test_the_end_of_a_code_that_began_too_early_is_no_line_either():
    hand = asked_for_an_id().line("18")
    assert hand.sent == []
    assert "Typed too early" in hand.state.message
    hand.now += 0.31
    assert hand.line("N-0418").sent == ["N-0418"]


def test_what_was_told_between_two_questions_is_read_on_the_next_screen():
    for subject, kind in ((touch_subject(), Question.PLACE), (OLD_OR_NEW, Question.TEXT)):
        hand = Sitting().happens(WasTold("Tool 1 is not what the last calibration left."))
        hand.asked(subject, kind)
        text = "\n".join(screen_of(hand.state, hand.now).rows())
        assert "not what the last calibration left" in text
        hand.asked(subject, kind)
        assert "last calibration" not in "\n".join(screen_of(hand.state, hand.now).rows())


@pytest.mark.parametrize("count", range(1, 16))
def test_nothing_of_a_proposal_is_left_out_before_it_is_written(count):
    subject = write_subject(*range(1, count + 1))
    stations = dict.fromkeys(range(1, count + 1), ("PIN-07",))
    hand = Sitting().asked(replace(subject, stations=stations), Question.YES_NO)
    seen = ""
    for _ in range(12):
        rows = screen_of(hand.state, hand.now).rows()
        assert len(rows) == 24
        seen += "\n".join(rows)
        assert "To write, type" in rows[-5] + "".join(rows)
        hand.keys(".")
    for tool in range(1, count + 1):
        assert f" Tool {tool} " in seen
        assert f"Stations found with tool {tool}: 1" in seen
    assert any("Stations found with tool 1" in row for row in told_before(hand.state))
    assert count > 1 or "Programs using tool 1 will now run" in seen
    assert count > 1 or "corrects the" in seen


def test_the_state_row_says_nothing_that_was_not_read():
    reading = Reading(10.0, "ready")
    assert status_row(status_of(reading, 10.0)) == "READY   reading 0.0 s"
    reading = Reading(10.0, "ready", motors=False, low_power=False)
    assert status_row(status_of(reading, 10.0)) == "READY   motors OFF   power HIGH   reading 0.0 s"


def test_power_and_motors_are_those_of_the_controller():
    simulator = EpsonSimulator(seed=7)
    simulator.machine.power_high = True
    with (
        serve_tcp(simulator, clock=ScaledClock(10.0)) as host,
        robolink.connect(host.url) as controller,
    ):
        glance = ControllerGlance(controller)
        seen, going = glance.at_rest(), glance.on_the_way()
        assert seen is not None
        assert going is not None
        assert (seen.motors, seen.low_power) == (True, False)
        assert (going.motors, going.low_power) == (True, True)


class Presser(Desk):
    """Presses the emergency stop while the list is read, and waits for the effect."""

    def __init__(self, simulator):
        super().__init__()
        self.simulator, self.polled = simulator, 0

    def poll(self, wait_s):
        self.polled += 1
        assert self.polled < 3, "the list goes on saying that the emergency stop is released"
        self.simulator.panel.press_estop()


def test_a_list_does_not_go_on_saying_what_is_no_longer_so():
    simulator = EpsonSimulator(seed=7)
    with (
        serve_tcp(simulator, clock=ScaledClock(10.0)) as host,
        robolink.connect(host.url) as controller,
        click.Context(click.Command("change")),
        sitting_at(Presser(simulator)),
        pytest.raises(NotReadyError, match="emergency stop is pressed"),
    ):
        check_before_start(controller, "to look", moves=2, speed_mm_s=20.0, box_mm=60.0, at=None)


class Leaver(Desk):
    """Looks at the list, and leaves."""

    def poll(self, wait_s):
        return "n"


def listed(controller, *tools, at=None):
    """Return the texts of the check list, and its plan."""
    desk = Leaver()
    with click.Context(click.Command("change")), sitting_at(desk), pytest.raises(DeclinedError):
        check_before_start(
            controller, "to look", moves=2, speed_mm_s=20.0, box_mm=60.0, at=at, tools=tools
        )
    (subject,) = (
        one.subject
        for one in desk.happened()
        if isinstance(one, WasRegarded) and isinstance(one.subject, CheckSubject)
    )
    return " ".join((*(point.text for point in subject.points), subject.plan))


def test_a_list_claims_of_a_plc_only_what_its_mailbox_tells():
    with (
        serve_tcp(EpsonSimulator(seed=7), clock=ScaledClock(10.0)) as host,
        robolink.connect(host.url) as controller,
    ):
        said = listed(controller, at=StationKind.BEAMS)
        assert "tip and beams are clean" in said
        assert "pin" not in said, "there is none"
        assert "serial C-SIM" in said
        assert "firmware 7." in said
        assert "guard closed" in said
        assert "power LOW" in said
    with (
        serve_modbus_tcp(SoftMotionSimulator(seed=3)) as plc,
        robolink.connect(plc.url) as controller,
    ):
        controller.motors(True)
        said = listed(controller)
        assert "guard" not in said
        assert "LOW" not in said
        assert "permits movements" in said


def test_a_list_says_which_backup_there_is_on_this_computer(tmp_path, monkeypatch):
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
    with serve_tcp(EpsonSimulator(seed=7), clock=ScaledClock(10.0)) as host:
        with robolink.connect(host.url) as controller:
            said = listed(controller)
            assert "The tools are not saved: this computer has no backup" in said
            path = keep_first_backup(controller)
            assert path is not None
            kept = load(path)
            save(replace(kept, saved_at="2026-11-20T12:58:00.000Z"), path, replace=True)
            when = local_label("2026-11-20T12:58:00.000Z")
            assert f"All 15 tools are saved: backup of {when}" in listed(controller)
            path.write_text("{", encoding="utf-8")
            said = listed(controller)
            assert "The tools are not saved: " in said
            assert str(path) in said
            path.unlink()
            assert "has no backup of this controller" in listed(controller)
        with robolink.connect("epson+sim://no-backup") as controller:
            assert "the simulation ends with this command" in listed(controller)


def test_a_backup_that_is_missing_keeps_nobody_from_starting():
    points = (CheckPoint(Mark.LOOK, "No backup."), CheckPoint(Mark.YOU, "Clear.", "clear", "Yes"))
    hand = Sitting().asked(CheckSubject(points, ""), Question.YES_NO)
    assert screen_of(hand.state, hand.now).lines[0].split()[0] == "LOOK"
    assert hand.keys("2", "5", "2", "5").sent == ["y"]


def test_a_list_says_how_a_tool_was_left_and_nothing_of_one_that_somebody_changed():
    simulator, new = EpsonSimulator(seed=7), ToolOffset(12.5, -3.0, -20.0)
    with serve_tcp(simulator, clock=ScaledClock(10.0)) as host:
        log = memory_journal(host.url).log(host.url, signature=Signature(nozzle="N-0417"))
        with robolink.connect(host.url, outcomes=log) as controller:
            assert "unchanged since the last change" not in listed(controller, 1)
            change_tools(controller, [Wanted(1, new, controller.tools.read(1))])
            said = listed(controller, 1)
            assert f"Tool 1 is unchanged since the last change: {describe_offset(new)}." in said
            assert "needle N-0417" in said
            simulator.machine.tools.set(1, ToolOffset(12.6, -3.0, -20.0))
            assert "unchanged since the last change" not in listed(controller, 1)


def test_lines_say_of_each_job_what_it_does():
    jobs = replace(OLD_OR_NEW, details=(("It writes.",), ("It tests.",)))
    hand = Sitting().asked(jobs, Question.TEXT)
    assert told_before(hand.state) == [
        "  1 The old one.",
        "    It writes.",
        "  2 The new one.",
        "    It tests.",
    ]


class Chooser(Desk):
    """A person who chooses rows by their numbers."""

    def __init__(self, *rows):
        super().__init__()
        self.rows, self.marked = list(rows), []
        self.header = None

    def look(self):
        pass

    def regard(self, subject):
        if isinstance(subject, ChoiceSubject):
            self.marked.append((subject.options[subject.marked or 0].split()[0], subject.step))
        if isinstance(subject, Header):
            self.header = subject

    def poll(self, wait_s):
        return str(self.rows.pop(0))


@pytest.mark.parametrize(("row", "keeps"), [(2, True), (1, False)])
def test_the_next_tool_is_chosen_anew_and_takes_nothing_of_the_line_along(
    tmp_path, monkeypatch, row, keeps
):
    monkeypatch.chdir(tmp_path)
    recipe = RECIPES / "needle-one-touch.toml"
    (tmp_path / "a.toml").write_text(recipe.read_text(encoding="utf-8"), encoding="utf-8")
    cells = "".join(f'[cells.line{n}]\nurl = "epson+tcp://127.0.0.1:{n}"\n' for n in (3, 4))
    (tmp_path / "robolink.toml").write_text(cells)
    typed = ["-c", "line4", "change", "b.toml", "--nozzle", "N-0417", "--timeout", "9"]
    given = {"url": "line4", "timeout_s": 9.0, "operator": "Lin"}
    context, desk = click.Context(click.Command("x")), Chooser(row, 1)
    context.meta.update({TYPED: typed, GIVEN: given})
    with context, sitting_at(desk):
        at, loaded = _chosen_anew(context_of_cell("line4"))
    assert desk.marked[0][0] == "line4", "the cell of the job before is marked"
    assert loaded.path.name == "a.toml"
    assert at.cell is not None
    assert at.cell.name == ("line4" if keeps else "line3")
    # The line about one cell does not apply to another; the user there has it locked.
    assert (at.timeout_s, at.operator, at.nozzle) == (9.0 if keeps else 3.0, "Lin", "")
    assert desk.header is not None
    assert desk.header.command == f"robolink -c {at.cell.name} change a.toml"


def test_a_job_is_chosen_by_what_it_does_and_when_it_did_so_last(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    recipe = RECIPES / "needle-one-touch.toml"
    (tmp_path / "a.toml").write_text(recipe.read_text(encoding="utf-8"), encoding="utf-8")
    name = load_recipe(tmp_path / "a.toml").name
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))

    def offered(rows=False):
        desk = Leaver()
        with pytest.raises(DeclinedError):
            choose_recipe(desk, None, "epson+tcp://x:5000?timeout=3")
        (subject,) = (
            one.subject
            for one in desk.happened()
            if isinstance(one, WasRegarded) and isinstance(one.subject, ChoiceSubject)
        )
        return subject.options if rows else subject.details[0]

    assert offered()[0] == "Touch a known pin once: X, Y and Z, for a change of the needle."
    assert offered()[1] == "Tool: 1"
    assert len(offered()) == 2
    log = open_log("x", durable=True, signature=Signature(recipe=name, nozzle="N-7"))
    log.append(NewEntry(EntryKind.DONE, tool=1, details={"took_s": 600.0}))
    log.close()
    assert offered()[2].startswith("Used so far only on another robot, x, last ")
    assert "needle N-7" not in offered()[2], "that was on another robot"
    other = (
        (tmp_path / "a.toml").read_text(encoding="utf-8").replace(f'name = "{name}"', 'name = "B"')
    )
    (tmp_path / "b.toml").write_text(other, encoding="utf-8")
    assert [row.partition(" ")[0] for row in offered(rows=True)] == ["B", name.partition(" ")[0]]
    (tmp_path / "b.toml").write_text(
        other.replace('name = "B"', 'name = "B"\ncells = ["line3"]'), encoding="utf-8"
    )
    assert len(offered(rows=True)) == 1, "one for another cell is not offered"
    (tmp_path / "b.toml").unlink()
    assert "about" not in offered(rows=True)[0], "of another cell, and nobody knows how long"
    here = open_log("epson+tcp://x:5000", durable=True, signature=Signature(recipe=name))
    touch = {
        "station": "PIN-07", "x_mm": 1.0, "y_mm": 2.0, "z_mm": 3.0, "u_deg": 0.0,
        "sigma_mm": 0.01, "changes": 13, "full_sigma_mm": 0.01, "touch_sigma_mm": 0.02,
    }  # fmt: skip
    value = [12.0, -3.5, -20.0, 0.0, 0.0, 0.0]
    for seconds, changes in ((130.0, 14), (170.0, 15), (900.0, 16)):
        details = {"touch": touch | {"changes": changes}, "value": value, "took_s": seconds}
        here.append(NewEntry(EntryKind.DONE, change=f"c{changes}", tool=1, details=details))
    assert offered(rows=True)[0].endswith(f"{name}   (a.toml)   about 3 min"), "170 s, the median"
    assert offered()[-1] == "A full calibration is due after 4 more changes."
    for more, said in ((19, "after one more change."), (20, "now."), (31, "now.")):
        details = {"touch": touch | {"changes": more}, "value": value}
        here.append(NewEntry(EntryKind.DONE, tool=1, details=details))
        assert offered()[-1] == f"A full calibration is due {said}"
    # Another value was written since: the method would refuse, with its own reason.
    here.append(NewEntry(EntryKind.READ_BACK, tool=1, details={"value": [1.0, *value[1:]]}))
    assert "due" not in offered()[-1]
    here.close()


def rows_offered(url, cell=None):
    return choice_offered(url, cell).options


def choice_offered(url, cell=None):
    desk = Leaver()
    with pytest.raises(DeclinedError):
        choose_recipe(desk, cell, url)
    (subject,) = (
        one.subject
        for one in desk.happened()
        if isinstance(one, WasRegarded) and isinstance(one.subject, ChoiceSubject)
    )
    return subject


def jobs_offered(url):
    return [row.rpartition("(")[2].rstrip(")") for row in rows_offered(url)]


def test_a_job_that_this_kind_of_controller_cannot_do_is_not_offered(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
    for name in ("pendant-points", "scara-pin"):
        shutil.copy(RECIPES / f"{name}.toml", tmp_path)
    assert jobs_offered("epson+tcp://x:5000") == ["pendant-points.toml", "scara-pin.toml"]
    assert jobs_offered("softmotion+modbus-tcp://x") == ["scara-pin.toml"]
    assert jobs_offered("gantry+usb://x") == ["pendant-points.toml", "scara-pin.toml"]
    with pytest.raises(ConfigError, match=r"scara-pin.toml: The recipe moves the robot"):
        jobs_offered("plc+modbus-tcp://x?map=a.toml")


def test_where_there_is_no_recipe_one_that_fits_is_copied_and_not_run(tmp_path, monkeypatch):
    cells = tmp_path / "cells"
    cells.mkdir()
    (cells / "robolink.toml").write_text('[cells.line3]\nurl = "softmotion+modbus-tcp://x"\n')
    monkeypatch.chdir(cells)
    cell = find_cell("line3")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ConfigError, match="Do not run it yet") as told:
        choose_recipe(desk := Chooser(1), cell, cell.url)
    (path,) = cells.glob("gantry*.toml")
    assert desk.marked == [("gantry-touch-probe", "Choose")]
    assert path.name in told.value.what
    assert load_recipe(path).recipe.numbers == "simulated"
    offered = rows_offered(cell.url)
    assert "scara-pin" in offered
    assert {"five-axes-pivot", "sphere"} <= set(offered[-3:]), "what few robots can comes last"
    assert "pendant-points" not in offered, "a PLC has no taught points"
    assert not list(tmp_path.glob("*.toml")), "whoever leaves has nothing written"


def test_the_step_is_numbered_where_that_cuts_nothing_off():
    header = replace(HEADER, job="Change needle", simulated=True)
    state = WizardState(header)
    assert title_row(head_of(state, "Check", JobStep.CHECK))[1] == "2 of 7  Check  SIMULATED"
    assert title_row(head_of(state, "Question"))[1] == "Question  SIMULATED"
    for cell, said in (("c" * 37, "2 of 7  Check  SIMULATED"), ("c" * 38, "Check  SIMULATED")):
        left, right = title_row(
            head_of(replace(state, header=replace(header, cell=cell)), "Check", JobStep.CHECK)
        )
        assert (left, right) == (f"{cell}   Change needle", said)
    assert (
        title_row(head_of(replace(state, header=replace(header, steps=0)), "x", JobStep.CHECK))[1][
            0
        ]
        == "x"
    )
    shorter = replace(state, header=replace(header, steps=6))
    assert title_row(head_of(shorter, "On the way", JobStep.TURN_TEST))[1].startswith(
        "6 of 6  On the way"
    )


@pytest.mark.parametrize(("keys", "number"), [(("1", "*"), "7 of 7"), (("n",), "3 of 7")])
def test_movements_after_a_write_was_agreed_to_are_those_of_the_turn_test(keys, number):
    hand = Sitting().asked(CheckSubject((), ""), Question.YES_NO).keys("2", "5")
    assert hand.sent == ["y"]
    hand.asked(write_subject(1), Question.YES_NO).keys(*keys)
    going = MoveSubject(Pose(300.0, 400.0, -60.0, 90.0, tool=0), Way.JOINT, 20.0, "Up.")
    hand.happens(WasRegarded(going))
    assert screen_of(hand.state, hand.now).title[1] == f"{number}  On the way"


def test_a_recipe_without_a_turn_test_has_one_step_less(tmp_path):
    text = (RECIPES / "needle-one-touch.toml").read_text(encoding="utf-8")
    without = text.replace("[source]", "verify = false\n[source]").replace("drift_mm = 0.1", "")
    for said, number in ((text, 7), (without, 6)):
        path = tmp_path / "a.toml"
        path.write_text(said, encoding="utf-8")
        assert steps_of(load_recipe(path)) == number


@pytest.mark.parametrize("copies", [True, False], ids=["to copy", "to run"])
@pytest.mark.parametrize(
    ("url", "robot", "tilts"),
    [
        ("epson+tcp://x:5000", "T6-602S", "no"),
        ("epson+tcp://x:5000", "C8-C901S", "yes"),
        ("softmotion+modbus-tcp://x", "Kin_Scara3_Z", "no"),
        ("softmotion+modbus-tcp://x", "Kin_5Axes", "yes"),
        ("softmotion+modbus-tcp://x", "Kin_Gantry3+Kin_CAxis", "nobody knows"),
        ("epson+tcp://x:5000", "", "nobody knows"),
    ],
)
def test_what_the_robot_of_the_cell_cannot_tilt_for_is_not_offered_and_else_that_is_said(
    tmp_path, monkeypatch, url, robot, tilts, copies
):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
    named = f'robot = "{robot}"\n' if robot else ""
    (tmp_path / "robolink.toml").write_text(f'[cells.line3]\nurl = "{url}"\n{named}')
    if not copies:
        for name in ("five-axes-pivot", "scara-pin"):
            shutil.copy(RECIPES / f"{name}.toml", tmp_path)
    subject = choice_offered(url, find_cell("line3"))
    rows = [
        " ".join((row, *said)) for row, said in zip(subject.options, subject.details, strict=True)
    ]
    (pivot,) = [row for row in rows if "five-axes-pivot" in row] or [""]
    assert any("scara-pin" in row for row in rows), "it turns about Z, which each of them can"
    assert bool(pivot) is (tilts != "no")
    assert ("Needs a robot that tilts" in pivot) is (tilts == "nobody knows")
    assert sum("Needs a robot that tilts" in row for row in rows) == (
        0 if tilts != "nobody knows" else 3 if copies else 1
    )


@pytest.mark.parametrize(
    ("drawn", "tools", "said"),
    [
        (True, 1, []),
        (True, 2, ["Measuring tool 2."]),
        (False, 1, ["-- tool 2: measure", "-- propose and write"]),
    ],
)
def test_a_screen_is_not_headed_twice_and_says_which_of_several_tools(
    monkeypatch, drawn, tools, said
):
    told: list[str] = []
    nothing = click.Context(click.Command("x"))
    monkeypatch.setattr(run_events, "drawn_elsewhere", lambda: drawn)
    monkeypatch.setattr(run_events, "note", told.append)
    progress = run_events.Progress(run_events.EventStream(nothing, on=False), tools)
    bench: Any = None
    progress.moment(Moment.BEFORE_MEASURE, bench, 2)
    progress.moment(Moment.BEFORE_WRITE, bench)
    assert told == said


class Onlooker(Desk):
    """Records the subjects given to the desk."""

    def __init__(self):
        super().__init__()
        self.subjects = []

    def look(self):
        pass

    def regard(self, subject):
        self.subjects.append(subject)


def test_a_calibration_ends_with_its_result_at_the_desk(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
    url = "epson+sim://desk-of-a-calibration"
    assert main.run(["-c", url, "status"]) == 0
    simulator_named("desk-of-a-calibration").machine.motors_on = True
    desk = Onlooker()
    words = ["two-pose", "--tool", "1", "--assist", url, "--sigma", "0.01", "--yes"]
    try:
        with sitting_at(desk):
            assert main.run(["-c", url, "calibrate", *words, "--no-verify"]) == 0
    finally:
        unregister("desk-of-a-calibration")
    assert isinstance(desk.subjects[-1], ChangeReport)


@pytest.mark.parametrize(
    ("name", "rows"),
    [
        ("n", ("n   (n.toml)       about 2 min", "two   (two.toml)")),
        ("n" * 70, (f"about 2 min   {'n' * 70}   (n.toml)", "two   (two.toml)")),
    ],
    ids=["behind its name", "before a long one"],
)
def test_how_long_a_recipe_takes_is_never_cut_off(name, rows):
    recipes: Any = [
        SimpleNamespace(name=one, path=Path(file))
        for one, file in ((name, "n.toml"), ("two", "two.toml"))
    ]
    pasts: Any = [SimpleNamespace(usual_s=120.0), SimpleNamespace(usual_s=None)]
    assert _rows_of(recipes, pasts) == rows
