"""What becomes of the work when its face cannot show it any more."""

import os
import threading

import click
import pytest
from robolink_cli.prompts.current_desk import current_desk
from robolink_cli.wizard.host import _shown, guided
from robolink_cli.wizard.state import WizardState
from robolink_cli.wizard.work import Desk, Work

from robolink.calibration_run import ChangeReport, ToolReport
from robolink.errors import ConfigError, DeclinedError
from robolink.model import ToolReceipt
from robolink.runner import Question
from tests.cli.wizard._people import HEADER, write_subject


class Typist:
    """Types a line each time the dialogue offers something at its end, and keeps what it was told.

    Args:
        lines: What is typed, in their order.
    """

    def __init__(self, lines):
        self.lines, self.seen = list(lines), ""
        self._far, self._near = os.pipe()
        self.input = os.fdopen(self._far, encoding="utf-8")

    def write(self, text):
        self.seen += text
        if "finish = leave." in text and self.lines:
            threading.Timer(0.1, os.write, (self._near, self.lines.pop(0).encode() + b"\n")).start()
        return len(text)

    def flush(self):
        """Nothing is held back."""


def carried_out():
    """Return what a change of one tool reports."""
    (proposal,), ((verdict,),) = (one := write_subject(1)).proposals, one.verdicts
    receipt = ToolReceipt(1, proposal.before, proposal.offset, proposal.offset)
    return ChangeReport("7f3a5c1200", (ToolReport(proposal, receipt, None, (verdict,)),))


@pytest.mark.parametrize("taken", [True, False])
def test_lines_offer_the_page_and_the_next_tool_once_a_job_is_carried_out(monkeypatch, taken):
    typist = Typist(["", "report", "report", "next", "finish"])
    monkeypatch.setenv("ROBOLINK_PLAIN", "1")
    monkeypatch.setattr("sys.stdin", typist.input)
    monkeypatch.setattr("sys.stderr", typist)
    done, pages = [], []

    def job(name):
        done.append(name)
        desk = current_desk()
        assert desk is not None
        desk.regard(None)
        desk.regard(carried_out())
        return name

    def page(change):
        pages.append(change)
        if not taken:
            raise ConfigError("There is a file of that name.", remedy="Move it.")
        return ("Report: /cell/change.html",)

    with click.Context(click.Command("x")):
        last = guided(HEADER, lambda: job("first"), report=page, following=lambda: job("second"))
    assert (done, last) == (["first", "second"], "second")
    assert typist.lines == []
    # The page is written once; where it could not be, it is offered again.
    assert pages == ["7f3a5c1200"] * (1 if taken else 2)
    said = "Report: /cell/change.html" if taken else "There is a file of that name."
    assert typist.seen.count(said) == len(pages)
    assert typist.seen.count("Tool 1 is measured and written, not tested.") == 2, "each job once"
    assert typist.seen.count("report = show the report.") == (3 if taken else 5)


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
