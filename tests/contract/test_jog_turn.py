"""``robot jog --turn``: half a turn is one command, checked all the way round, and ends lifted."""

import math

import pytest

from robolink.model import Path, ToolOffset
from robolink.runner import Runner
from tests.contract._method_cell import KINDS, method_cell

pytestmark = pytest.mark.simulator_only
soak = pytest.mark.soak


@pytest.fixture(params=KINDS)
def cell(request, tmp_path, monkeypatch):
    with method_cell(request.param, tmp_path, monkeypatch) as cell:
        yield cell


def where(cell):
    with cell.cell.connected() as controller:
        return controller.groups[0].pose()


def stands(cell, before):
    """Whether the tip is at its old place; read positions scatter by some micrometres."""
    return where(cell).coordinates() == pytest.approx(before.coordinates(), abs=0.02)


def select(cell, tool):
    with cell.cell.connected() as controller:
        controller.tools.select(tool)


def turned(before, after, by_deg):
    apart = (after.u_deg - before.u_deg - by_deg + 180) % 360 - 180
    return apart == pytest.approx(0, abs=0.01)


@pytest.fixture
def went(monkeypatch):
    """Every movement that was begun."""
    found, move = [], Runner.move

    def noted(runner, target, path):
        found.append((target, path))
        return move(runner, target, path)

    monkeypatch.setattr(Runner, "move", noted)
    return found


def each_once(*rows):
    """Return rows of controller kind and case; the other combinations run only in soak."""
    (first, *one), (second, *other) = rows
    others = (pytest.param(first, *other, marks=soak), pytest.param(second, *one, marks=soak))
    return [*rows, *others]


@pytest.mark.parametrize(("cell", "tool"), each_once(("epson", 1), ("plc", 0)), indirect=["cell"])
def test_half_a_turn_is_one_command_that_ends_lifted(cell, went, tool):
    select(cell, tool)
    before = where(cell)
    done = cell.run("robot", "jog", "--turn", "180", "--lift", "12", "--yes", "--speed", "100")
    assert done.code == 0, done.err
    after = where(cell)
    assert turned(before, after, 180)
    assert after.z_mm - before.z_mm == pytest.approx(12, abs=0.01)
    assert math.dist(before.coordinates()[:2], after.coordinates()[:2]) < 0.02
    assert "It stays lifted by 12 mm" in done.out
    # Straight up first; then round in turns so short that chord and arc are the same.
    (up, path), *turns = went
    assert (path, up.u_deg) == (Path.STRAIGHT, before.u_deg)
    assert len(turns) == 12
    assert {path for _, path in turns} == {Path.JOINT}
    back = cell.run("robot", "jog", "--turn", "-180", "--yes", "--speed", "100")
    assert back.code == 0, back.err
    assert turned(before, where(cell), 0)


def test_a_plain_step_keeps_its_limit_and_names_the_command(cell):
    before = where(cell)
    refused = cell.run("robot", "jog", "u+180", "--yes")
    assert refused.code == 2, refused.err
    assert "robolink robot jog --turn 180" in refused.err
    assert stands(cell, before)


@pytest.mark.parametrize(
    ("cell", "tool", "named"),
    each_once(("plc", 0, "tip of tool 1"), ("epson", 1, "flange")),
    indirect=["cell"],
)
def test_the_way_between_is_checked_of_tip_and_flange(cell, went, tool, named):
    # A whole turn ends where it began: only the places between are too far.
    offset = ToolOffset(30, 0, -20)
    with cell.cell.connected() as controller:
        controller.tools.write(1, offset, expected=controller.tools.read(1))
        controller.tools.select(tool)
    before = where(cell)
    refused = cell.run("robot", "jog", "--turn", "360", "--yes")
    assert refused.code == 2, refused.err
    assert f"the {named} would be " in refused.err
    assert "50 mm is allowed. Nothing moved." in refused.err
    assert went == []
    assert stands(cell, before)
    # Half of it fits into a wide box, and not into a narrow one.
    assert cell.run("robot", "jog", "--turn", "180", "--box", "40", "--yes").code == 2
    done = cell.run("robot", "jog", "--turn", "-180", "--box", "61", "--yes", "--speed", "100")
    assert done.code == 0, done.err


def test_a_tip_that_is_named_is_the_one_that_counts(arm):
    with arm.cell.connected() as controller:
        controller.tools.write(3, ToolOffset(80, 0, -20), expected=controller.tools.read(3))
        controller.tools.select(0)
    refused = arm.run("robot", "jog", "--turn", "90", "--yes")
    assert refused.code == 2
    assert "tip of tool 3" in refused.err
    done = arm.run("robot", "jog", "--turn", "90", "--tip", "1", "--yes", "--speed", "100")
    assert done.code == 0, done.err
    undefined = arm.run("robot", "jog", "--turn", "90", "--tip", "9", "--yes")
    assert (undefined.code, "Tool 9 is not defined" in undefined.err) == (2, True)
    select(arm, 1)
    other = arm.run("robot", "jog", "--turn", "90", "--tip", "3", "--yes")
    assert (other.code, "turns about that tip" in other.err) == (2, True)


def test_it_asks_before_it_moves_and_nobody_there_is_a_no(arm, monkeypatch, went):
    refused = arm.run("robot", "jog", "--turn", "180")
    assert refused.code == 9
    assert "there is nobody to ask" in refused.err
    asked = []

    def answered(question):
        asked.append(question)
        return False

    monkeypatch.setattr("robolink_cli.prompts.questions.person_here", lambda: True)
    monkeypatch.setattr("robolink_cli.session.motion_consent.person_here", lambda: True)
    monkeypatch.setattr("robolink_cli.prompts.questions.asked", answered)
    assert arm.run("robot", "jog", "--turn", "-180").code == 9
    (question,) = asked
    assert "up by 10 mm, then U by -180 degrees, and stay there" in question
    assert went == []


def test_a_dry_run_shows_all_of_it_and_sends_nothing(arm, went):
    done = arm.run("robot", "jog", "--turn", "180", "--dry-run", "--json")
    assert done.code == 0, done.err
    assert sum("Go XY" in request for request in done.document["requests"]) == 12
    assert went == []


@pytest.mark.parametrize(("by", "code"), [("ctrl-c", 130), ("latch", 10)])
def test_what_ends_it_on_the_way_ends_it_where_it_is(arm, monkeypatch, by, code):
    count, move = [], Runner.move

    def moves(runner, target, path):
        count.append(target)
        if len(count) == 5 and by == "ctrl-c":
            raise KeyboardInterrupt
        if len(count) == 5:
            runner._controller.latch.close()
        return move(runner, target, path)

    monkeypatch.setattr(Runner, "move", moves)
    ended = arm.run("robot", "jog", "--turn", "180", "--yes", "--speed", "100")
    assert ended.code == code, ended.err
    assert len(count) == 5


@pytest.mark.parametrize(
    "words", [("--turn", "0"), ("--turn", "361"), ("--turn", "nan"), ("--turn", "90", "x+1"),
              ("--lift", "5", "x+1"), ("--tip", "1", "x+1"), ("--turn", "90", "--lift", "0")],
)  # fmt: skip
def test_what_does_not_go_together_is_a_slip_of_the_command(arm, went, words):
    refused = arm.run("robot", "jog", *words, "--yes")
    assert refused.code == 2, refused.err
    assert went == []
