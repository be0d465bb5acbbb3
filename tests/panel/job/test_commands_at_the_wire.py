"""Other commands at the wire: what they ask becomes a view, what they print is their end."""

import pytest
from robolink_cli import main
from robolink_cli.wizard.views.records import (
    CheckView,
    ChoiceView,
    EndView,
    FitView,
    QuestionView,
    TouchView,
    ValuesView,
)
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.control.assist import InProcessEyes
from robolink_simulators.hosting.fieldbus.modbus import serve_modbus_tcp
from robolink_simulators.softmotion.group.condition import SmcGroupState
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

from tests.panel.job._tablet import Hand, at_the_wire, to_the_jog

BODIES = (ChoiceView, CheckView, TouchView, QuestionView, FitView, ValuesView, EndView)


def lines_of(body):
    return "\n".join(body.lines)


def through(arguments, *, answers=None, eyes=None, states=None):
    """Answer whatever is asked; return the exit code, the last body, and what was shown."""
    seen = []

    def script(tablet):
        hand = Hand(tablet, eyes)
        while True:
            body = tablet.body(BODIES)
            seen.append(body)
            if states is not None and tablet.view.status is not None:
                states.append(tablet.view.status.state)
            number = tablet.view.number
            match body:
                case EndView(done=done):
                    tablet.press("finish" if done else "leave")
                    return
                case TouchView(free=True):
                    tablet.press("leave")
                case TouchView():
                    hand.touch()
                    continue
                case ChoiceView(rows=rows):
                    tablet.press("choose", rows[0].value)
                case CheckView(rows=rows, open=left):
                    todo = [one for one in rows if one.mark == "you" and not one.confirmed]
                    if left:
                        tablet.press("confirm", todo[0].name)
                        tablet.changes(body)
                        continue
                    tablet.press("start")
                case ValuesView(tools=tools):
                    tablet.press("write", "".join(str(one.tool) for one in tools))
                case FitView():
                    tablet.press("go_on")
                case QuestionView(text=True):
                    tablet.press("answer", "anna")
                case QuestionView():
                    tablet.press((answers or {}).get(len(seen), "yes"))
            tablet.goes_on(number)

    code, tablet = at_the_wire(arguments, script)
    assert tablet.left["code"] == code
    return code, seen[-1], seen


def test_an_undo_shows_what_it_will_do_asks_and_tells_what_it_did(robot):
    simulator, _, url = robot
    before = simulator.machine.tools.get(1)
    set_one = ["-c", url, "tool", "set", "1", "--x", "12.5", "--y", "-3.2", "--z", "-20", "--yes"]
    assert main.run(set_one) == 0
    assert simulator.machine.tools.get(1) != before
    code, end, seen = through(["-c", url, "undo"])
    question = next(one for one in seen if isinstance(one, QuestionView))
    assert question.question == "Write the old values back?"
    assert "12.5" in " ".join(question.told)
    assert (code, end.done) == (0, True)
    assert "Old values written and read back: tool 1." in lines_of(end)
    assert simulator.machine.tools.get(1) == before


def test_a_no_sends_nothing_and_its_end_says_so(robot):
    simulator, _, url = robot
    set_one = ["-c", url, "tool", "set", "1", "--x", "12.5", "--y", "-3.2", "--z", "-20", "--yes"]
    assert main.run(set_one) == 0
    after = simulator.machine.tools.get(1)
    code, end, _ = through(["-c", url, "undo"], answers={1: "no"})
    assert (code, end.done, end.blocked) == (9, False, False)
    assert "You answered no." in lines_of(end)
    assert simulator.machine.tools.get(1) == after


def test_a_stop_is_released_at_the_wire(robot):
    _, _, url = robot
    assert main.run(["-c", url, "stop"]) == 0
    assert main.run(["-c", url, "robot", "jog", "z+1", "--yes"]) == 10
    code, end, seen = through(["-c", url, "robot", "release"])
    question = next(one for one in seen if isinstance(one, QuestionView))
    assert "may the robot move again" in question.question
    assert (code, end.done) == (0, True)
    assert main.run(["-c", url, "robot", "jog", "z+1", "--yes"]) == 0


def test_a_plc_that_was_stopped_is_released_at_the_wire(robolink_state):
    simulator = SoftMotionSimulator(seed=3)
    with serve_modbus_tcp(simulator, clock=ScaledClock(20)) as host:
        assert main.run(["-c", host.url, "stop"]) == 0
        code, _, _ = through(["-c", host.url, "robot", "release"], answers={1: "no"})
        assert (code, simulator.plc.group.state) == (9, SmcGroupState.STOPPING)
        states = list[str]()
        code, end, seen = through(["-c", host.url, "robot", "release"], states=states)
        question = next(one for one in seen if isinstance(one, QuestionView))
        assert "holds the axis group" in " ".join(question.told)
        assert (code, end.done) == (0, True)
        assert simulator.plc.group.state is SmcGroupState.STANDBY
        assert states[-1] == "ready", "its last screen shows how it was before"
        assert main.run(["-c", host.url, "robot", "jog", "z+1", "--yes"]) == 0


def test_a_reset_asks_at_the_wire(robot):
    _, _, url = robot
    code, end, seen = through(["-c", url, "robot", "reset"])
    assert any(isinstance(one, QuestionView) for one in seen)
    assert (code, end.done) == (0, True)
    assert lines_of(end)


def test_a_jog_by_hand_ends_with_where_it_is(robot):
    _, _, url = robot
    code, end, _ = through(["-c", url, "robot", "jog", "--keys"])
    assert (code, end.done) == (0, True)
    assert "X " in lines_of(end)


def test_a_station_is_learnt_by_hand_at_the_wire(robot):
    simulator, _, url = robot
    words = ["cell", "station", "learn", "PIN-09", "--tool", "1"]
    code, end, seen = through(["-c", url, *words], eyes=InProcessEyes(simulator))
    assert sum(isinstance(one, TouchView) for one in seen) >= 2
    assert (code, end.done) == (0, True), end
    assert "PIN-09" in lines_of(end)
    assert main.run(["-c", url, "cell", "station", "show", "PIN-09"]) == 0


def test_a_check_of_a_cell_tells_its_findings(robot, tmp_path, monkeypatch):
    _, _, url = robot
    monkeypatch.chdir(tmp_path)
    (tmp_path / "robolink.toml").write_text(f'[cells.line3]\nurl = "{url}"\n')
    code, end, _ = through(["-c", "line3", "cell", "check"])
    assert code in (0, 1)
    assert end.done
    assert "line3" in lines_of(end)


def test_a_job_that_was_refused_may_be_begun_again_from_its_last_screen(robot):
    simulator, _, url = robot
    numbers = []

    def script(tablet):
        simulator.machine.motors_on = False
        end = tablet.body(EndView)
        assert "otors" in lines_of(end)
        numbers.append(tablet.view.number)
        simulator.machine.motors_on = True
        tablet.press("begin_again")
        tablet.body(QuestionView)
        numbers.append(tablet.view.number)
        tablet.press("no")
        tablet.body(EndView)
        numbers.append(tablet.view.number)
        tablet.press("leave")

    simulator.machine.motors_on = False
    code, _ = at_the_wire(["-c", url, "robot", "jog", "--keys"], script)
    assert code == 9
    assert numbers == sorted(set(numbers)), "no number comes twice"


def test_nothing_more_is_asked_of_a_command_that_only_looks(robot):
    _, _, url = robot
    code, end, seen = through(["-c", url, "status"])
    assert len(seen) == 1
    assert (code, end.done) == (0, True)
    assert "ready" in lines_of(end).lower()


@pytest.mark.parametrize(
    ("words", "code"), [(["nonsense"], 2), (["undo", "--nonsense"], 2), (["undo"], 2), ([], 9)]
)
def test_a_line_that_is_wrong_ends_with_what_is_wrong(robot, tmp_path, monkeypatch, words, code):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    found, end, _ = through(words)
    assert not end.done
    assert lines_of(end)
    assert found == code or words == []


def test_the_language_of_the_job_is_that_of_its_process(robot, monkeypatch):
    _, _, url = robot
    monkeypatch.setenv("ROBOLINK_LANG", "zh")
    titles = []

    def script(tablet):
        to_the_jog(tablet)
        titles.append(tablet.view)
        tablet.press("leave")
        tablet.body(EndView)
        tablet.press("finish")

    assert at_the_wire(["-c", url, "robot", "jog", "--keys"], script)[0] == 0
    (view,) = titles
    assert not view.head.title.isascii()
    assert not view.actions[0].label.isascii()


def test_the_head_names_the_cell_and_the_job_before_the_first_question(robot):
    _, _, url = robot
    heads = []

    def script(tablet):
        tablet.body(QuestionView)
        heads.append(tablet.view.head)
        tablet.press("no")
        tablet.body(EndView)
        tablet.press("leave")

    at_the_wire(["-c", url, "robot", "reset"], script)
    assert (heads[0].cell, heads[0].job, heads[0].simulated) == (url, "Reset", True)
