"""Every command that writes or clears a tool obeys the cell's limits on change and person."""

import json

import pytest
from robolink_cli import main
from robolink_cli.commands.companions import serve
from robolink_cli.prompts import operator as _operator
from robolink_cli.prompts import questions as consent
from robolink_cli.prompts import questions as jumps

import robolink
from robolink.calibration_run import ChangePlan, NozzleChange, ToolPlan
from robolink.config import find_cell
from robolink.controllers import SimpleController, SimpleMachine
from robolink.errors import CalibrationError, NotAllowedError
from robolink.methods import PointsSource
from robolink.model import ChangeLimits, Jump, PersonRole, Pose, Signature, ToolOffset
from robolink.transaction import Wanted, change_tools

CELL = """
[cells.a]
url = "{url}"
{limits}
[cells.a.people]
anna = "operator"
eva = "engineer"
"""

STORED = ToolOffset(12.0, -3.5, -20.0)
SIGN_ERROR = ("tool", "set", "1", "--x", "-12")


@pytest.fixture
def tools(simulator):
    simulator.machine.tools.set(1, STORED)
    simulator.machine.tools.set(2, STORED)
    return simulator.machine.tools


@pytest.fixture
def cell(simulator, tools, tmp_path, monkeypatch, capsys):
    """Run a command on the cell as a person; return the exit code, the document and stderr."""

    def run(who, *words, limits="max_change_mm = 1.5\nmax_change_deg = 5"):
        path = tmp_path / "robolink.toml"
        path.write_text(CELL.format(url=simulator.url, limits=limits))
        monkeypatch.setenv("ROBOLINK_CONFIG", str(path))
        code = main.run(["-c", "a", "--operator", who, *words])
        shown = capsys.readouterr()
        return code, shown.out, shown.err

    return run


class Person:
    def __init__(self, answer):
        self.answer, self.questions = answer, []

    def ask(self, question, kind):
        self.questions.append(question)

    def tell(self, text):
        pass

    def poll(self, wait_s):
        return self.answer


@pytest.fixture
def person(monkeypatch, request):
    person = Person(request.param)
    for module in (consent, jumps):
        monkeypatch.setattr(module, "person_here", lambda: True)
    monkeypatch.setattr("robolink_cli.session.motion_consent.person_here", lambda: True)
    monkeypatch.setattr(_operator, "terminal", lambda: person)
    return person


@pytest.mark.fault("F39")
def test_an_operator_may_not_write_a_sign_error_and_is_told_the_figure(cell, tools):
    for more in ((), ("--yes",), ("--accept-jump", "30")):
        code, _, err = cell("anna", *SIGN_ERROR, *more)
        assert code == 9, err
        assert "anna may not accept a jump of tool 1 by 24.000 mm" in err
        assert "Ask an engineer" in err
    assert tools.get(1) == STORED


@pytest.mark.fault("F39")
def test_off_a_terminal_an_engineer_says_beforehand_how_far(cell, tools):
    for more in ((), ("--yes",), ("--accept-jump", "23.9")):
        code, _, err = cell("eva", *SIGN_ERROR, *more)
        assert code == 9, err
        assert "The tip of tool 1 would move 24.000 mm; this cell allows 1.500." in err
        assert "--accept-jump" in err
    assert tools.get(1) == STORED
    code, out, err = cell("eva", *SIGN_ERROR, "--accept-jump", "24.1", "--json")
    assert code == 0, err
    assert json.loads(out)["read_back"]["x_mm"] == -12.0


@pytest.mark.parametrize("person", ["y"], indirect=True)
def test_on_a_terminal_an_engineer_is_asked_with_the_figure_whatever_yes_says(cell, tools, person):
    code, _, err = cell("eva", *SIGN_ERROR, "--yes")
    assert code == 0, err
    (question,) = person.questions
    assert "would move 24.000 mm; this cell allows 1.500" in question
    assert tools.get(1) == ToolOffset(-12.0, -3.5, -20.0)


@pytest.mark.parametrize("person", ["n"], indirect=True)
def test_a_no_writes_nothing_and_an_operator_is_not_even_asked(cell, tools, person):
    assert cell("eva", *SIGN_ERROR)[0] == 9
    assert len(person.questions) == 1
    assert cell("anna", *SIGN_ERROR)[0] == 9
    assert len(person.questions) == 1
    assert tools.get(1) == STORED


@pytest.mark.parametrize("person", ["n"], indirect=True)
@pytest.mark.parametrize(
    "words", [("set", "1", "--x", "12.5"), ("clear", "2"), ("select", "2")], ids=lambda it: it[0]
)
def test_a_no_sets_clears_and_selects_nothing(run, tools, person, words):
    selected = tools.selected
    assert run("tool", *words)[0] == 9
    assert len(person.questions) == 1
    assert (tools.get(1), tools.get(2), tools.selected) == (STORED, STORED, selected)


def test_a_turn_has_a_limit_of_its_own(cell, tools):
    code, _, err = cell("eva", "tool", "set", "1", "--u", "6")
    assert code == 9
    assert "Tool 1 would turn by 6.000 degrees; this cell allows 5.000." in err
    assert cell("eva", "tool", "set", "1", "--u", "6", "--accept-turn", "7")[0] == 0
    assert tools.get(1).u_deg == 6.0


def test_what_the_cell_allows_anybody_writes(cell, tools):
    assert cell("anna", "tool", "set", "1", "--x", "13.4", "--u", "4")[0] == 0
    assert tools.get(1).x_mm == 13.4
    # 2 mm where the cell states nothing; a tool that has no value yet may get any.
    assert cell("anna", "tool", "set", "2", "--x", "13.9", limits="")[0] == 0
    assert cell("anna", "tool", "set", "2", "--x", "16.1", limits="")[0] == 9
    assert cell("anna", "tool", "set", "3", "--x", "100")[0] == 0


def test_a_url_alone_has_no_limits(run, tools):
    assert run(*SIGN_ERROR)[0] == 0


def test_a_program_that_knows_the_cell_is_held_to_it(cell, simulator, tools):
    assert cell("eva", "status")[0] == 0  # writes the cell file
    far = ToolOffset(-12.0, -3.5, -20.0)
    with robolink.connect(simulator.url, limits=find_cell("a").limits()) as controller:
        with pytest.raises(NotAllowedError, match="would move 24"):
            controller.tools.write(1, far, expected=STORED)
        near = Wanted(1, ToolOffset(12.5, -3.5, -20.0), STORED)
        with pytest.raises(NotAllowedError):  # of several tools none is written
            change_tools(controller, [near, Wanted(2, far, STORED)])
    assert (tools.get(1), tools.get(2)) == (STORED, STORED)


def test_a_measured_change_is_held_to_it_whatever_its_own_limit():
    class Nobody:
        def tell(self, text):
            pass

        def ask(self, question, kind):
            raise AssertionError(question)

        def poll(self, wait_s):
            raise AssertionError

    touches = [Pose(298, 99, -60, 0), Pose(322, 91, -60, 180)]
    plan = ToolPlan(1, source=PointsSource(lambda: touches), verify=False)  # 2 mm by default
    machine = SimpleMachine({1: ToolOffset(12, -3.5, -20)})
    with SimpleController(machine) as controller:
        controller.change_guard.limits = ChangeLimits(length_mm=0.4)
        change = NozzleChange(
            controller, ChangePlan((plan,), ask_before_write=False), operator=Nobody()
        )
        with pytest.raises(CalibrationError, match=r"0\.400 mm is allowed"):
            change.run()
    assert machine.read(1) == ToolOffset(12, -3.5, -20)


def test_a_restore_is_asked_about_and_an_undo_is_not(cell, tools, tmp_path):
    file = str(tmp_path / "tools.json")
    assert cell("eva", "backup", file)[0] == 0
    assert cell("eva", *SIGN_ERROR, "--accept-jump", "24.1")[0] == 0
    code, _, err = cell("eva", "restore", file, "--yes")
    assert code == 9
    assert "The tip of tool 1 would move 24.000 mm; this cell allows 1.500." in err
    assert tools.get(1).x_mm == -12.0
    # The earlier value was tested, and the record names the engineer who undoes.
    assert cell("eva", "undo", "--yes")[0] == 0
    assert tools.get(1) == STORED
    assert "accept a jump of tool 1 by 24.000 mm" in cell("eva", "journal", "list")[1]
    assert cell("eva", "undo", "--yes")[0] == 0
    assert cell("eva", "restore", file, "--yes", "--accept-jump", "24.1")[0] == 0
    assert tools.get(1) == STORED


@pytest.mark.parametrize(("said", "held_mm"), [("1", 1.0), ("3", 1.5)])
def test_a_program_that_calls_back_is_held_to_it(cell, monkeypatch, said, held_mm):
    held = []
    monkeypatch.setattr(
        serve, "_serve_programs", lambda _cell, _at, limits, **_: held.append(limits)
    )
    assert cell("eva", "serve", "--spel", "127.0.0.1:0", "--max-change-mm", said)[0] == 0
    assert [limits.max_change_mm for limits in held] == [held_mm]


def test_a_preview_says_by_how_much(cell, tools):
    code, _, err = cell("eva", *SIGN_ERROR, "--dry-run")
    assert code == 0
    assert "would move 24.000 mm; this cell allows 1.500" in err
    assert tools.get(1) == STORED


def test_an_operator_clears_nothing_from_a_program_either(simulator, tools):
    simulator.machine.tools.select(1)
    anna = Signature(operator="anna", role=PersonRole.OPERATOR)
    with robolink.connect(simulator.url, signature=anna) as controller:
        for then_select in (None, 2):
            with pytest.raises(NotAllowedError, match="anna may not clear tool 1"):
                controller.tools.clear(1, expected=STORED, then_select=then_select)
    assert (tools.get(1), tools.selected) == (STORED, 1)


def test_a_clear_takes_an_engineer(cell, tools):
    code, _, err = cell("anna", "tool", "clear", "2")
    assert code == 9
    assert "anna may not clear tool 2. Ask an engineer." in err
    assert tools.get(2) == STORED
    assert cell("eva", "tool", "clear", "2")[0] == 0
    assert tools.get(2) is None


def test_the_selected_tool_is_cleared_only_for_another_one(run, tools):
    for words in (("tool", "clear", "1"), ("tool", "clear", "1", "--dry-run")):
        code, _, err = run(*words)
        assert code == 5
        assert "Tool 1 is selected, so it was not cleared." in err
        assert "--then-select NUMBER" in err
    code, out, _ = run("tool", "clear", "1", "--then-select", "2", "--dry-run")
    assert code == 0
    assert [line for line in out.splitlines() if line.startswith("$")] == [
        '$Execute,"Tool 2"',
        '$Execute,"TLClr 1"',
    ]
    assert (tools.get(1), tools.selected) == (STORED, 1)
    code, out, _ = run("tool", "clear", "1", "--then-select", "2", "--json")
    assert (code, json.loads(out)["selected_tool"]) == (0, 2)
    assert (tools.get(1), tools.selected) == (None, 2)


def test_an_undo_to_undefined_wants_to_know_too(run, tools):
    assert run("tool", "set", "5", "--x", "1")[0] == 0
    assert run("tool", "select", "5")[0] == 0
    code, _, err = run("undo", "--tool", "5", "--yes")
    assert code == 5
    assert "Tool 5 is selected, so it was not cleared." in err
    assert run("undo", "--tool", "5", "--yes", "--then-select", "2")[0] == 0
    assert (tools.get(5), tools.selected) == (None, 2)


@pytest.mark.parametrize(
    ("a", "b", "angle_deg"),
    [
        (ToolOffset(u_deg=170), ToolOffset(u_deg=-170), 20.0),
        (ToolOffset(v_deg=30), ToolOffset(v_deg=-30), 60.0),
        (ToolOffset(w_deg=90), ToolOffset(w_deg=270), 180.0),
        (ToolOffset(u_deg=1e-4), ToolOffset(), 1e-4),
        # At V = 90 a turn about Z equals one about X: the same orientation in other numbers.
        (ToolOffset(u_deg=40, v_deg=90), ToolOffset(v_deg=90, w_deg=-40), 0.0),
    ],
)
def test_how_far_two_orientations_are_apart(a, b, angle_deg):
    assert Jump.between(a, b).angle_deg == pytest.approx(angle_deg, rel=1e-6, abs=1e-9)
    assert Jump.between(b, a).angle_deg == pytest.approx(angle_deg, rel=1e-6, abs=1e-9)
