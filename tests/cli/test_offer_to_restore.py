"""The next command reports that Tool 0 is still selected and offers to restore the old tool."""

import pytest
from robolink_cli import main
from robolink_cli.prompts import operator
from robolink_cli.prompts import questions as consent
from robolink_cli.session import connection
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.in_process.epson import register, unregister

import robolink
from robolink.controllers import EpsonController
from robolink.journal import memory_journal


class Person:
    """Answers every question alike."""

    def __init__(self, answer):
        self.answer, self.questions = answer, []

    def ask(self, question, kind):
        self.questions.append(question)

    def poll(self, wait_s):
        return self.answer


@pytest.fixture
def cell():
    """A simulator on which a calibration was killed with Tool 0 selected."""
    simulator = EpsonSimulator(seed=3)
    url = register("offer-to-restore", simulator)
    with robolink.connect(url) as controller:
        died = controller.preserved("calibrate tool 1")
        died.__enter__()
        controller.tools.select(0)
        assert isinstance(controller, EpsonController)
        controller._link.session.close()
    yield simulator, url
    unregister("offer-to-restore")
    memory_journal(url).close()


def open_markers(url):
    return memory_journal(url).log(url).open_markers()


@pytest.fixture
def person(monkeypatch, request):
    person = Person(request.param)
    monkeypatch.setattr(connection, "person_here", lambda: True)
    monkeypatch.setattr(consent, "person_here", lambda: True)
    monkeypatch.setattr("robolink_cli.session.motion_consent.person_here", lambda: True)
    monkeypatch.setattr("robolink_cli.stopping.notes.person_here", lambda: True)
    monkeypatch.setattr(operator, "terminal", lambda: person)
    return person


@pytest.mark.parametrize("person", ["y"], indirect=True)
def test_a_yes_selects_the_cells_own_tool_again(cell, person, capsys):
    simulator, url = cell
    assert main.run(["-c", url, "status"]) == 0
    assert simulator.machine.tools.selected == 1
    assert open_markers(url) == ()
    shown = capsys.readouterr()
    assert "Tool 0 is selected now; it was tool 1 before" in shown.err
    assert "tool 1 selected" in shown.out
    assert "Select tool 1 again" in person.questions[0]


@pytest.mark.parametrize("person", ["n"], indirect=True)
def test_a_no_changes_nothing_and_the_command_goes_on(cell, person, capsys):
    simulator, url = cell
    assert main.run(["-c", url, "status"]) == 0
    assert simulator.machine.tools.selected == 0
    assert len(open_markers(url)) == 1
    assert "tool 0 selected" in capsys.readouterr().out


@pytest.mark.parametrize("person", ["y"], indirect=True)
@pytest.mark.parametrize("words", [("stop",), ("status", "--json")])
def test_a_stop_and_a_script_are_asked_nothing(cell, person, words):
    simulator, url = cell
    assert main.run(["-c", url, *words]) == 0
    assert person.questions == []
    assert simulator.machine.tools.selected == 0


@pytest.mark.parametrize("person", ["y"], indirect=True)
def test_nothing_is_asked_of_a_controller_that_can_be_told_nothing(cell, person):
    simulator, url = cell
    simulator.panel.press_estop()
    assert main.run(["-c", url, "status"]) == 0
    assert person.questions == []
