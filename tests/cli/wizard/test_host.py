"""What becomes of the work when its face cannot show it any more."""

import click
import pytest
from robolink_cli.wizard.desk import Desk
from robolink_cli.wizard.host import _shown
from robolink_cli.wizard.state import WizardState
from robolink_cli.wizard.work import Work

from robolink.errors import DeclinedError
from robolink.runner import Question
from tests.cli.wizard._people import HEADER


class Breaking:
    """A face that breaks once something was asked."""

    def __init__(self, error):
        self.error = error

    def run(self, desk, state, work):
        while not desk.happened():
            pass
        raise self.error


@pytest.mark.parametrize("error", [EOFError(), OSError(5, "gone"), ZeroDivisionError()], ids=repr)
def test_the_work_is_ended_in_order_when_the_face_breaks(error):
    desk, put_back = Desk(), []

    def measure():
        try:
            desk.ask("Jog the tip onto the pin.", Question.PLACE)
            while desk.poll(0.2) is None:
                pass
        finally:
            put_back.append("tool 1")

    with click.Context(click.Command("x")):
        work = Work(measure)
        work.start()
        try:
            _shown(Breaking(error), desk, WizardState(HEADER), work)
        except ZeroDivisionError:
            assert isinstance(error, ZeroDivisionError)  # a defect is not hidden
        else:
            assert not isinstance(error, ZeroDivisionError)
    assert work.ended
    assert put_back == ["tool 1"]
    assert isinstance(work.error, DeclinedError)
