"""A person goes back to a touch, adds one, and goes back from the result, on a simulated robot.

They go back to a touch that slipped, so that repeating it must correct the result.
"""

import math
from functools import partial
from typing import Any

import pytest
from robolink_cli.prompts.operator import AssistedOperator
from robolink_simulators.control.assist import InProcessEyes

import robolink
from robolink.calibration import NeedleLimits
from robolink.calibration_run import ChangePlan, NozzleChange, ToolPlan
from robolink.errors import CalibrationError, DeclinedError
from robolink.methods import (
    NAngleSource,
    OneTouchSource,
    TwoPoseSource,
    difference_from_last,
)
from robolink.model import EntryKind
from robolink.procedures import SamplingPolicy
from robolink.runner import Question
from tests.contract._method_cell import method_cell

pytestmark = pytest.mark.simulator_only

SLIP = ["x+0.1", "x+0.1", ""]
"""The end of a touch that slipped: its last step is as fine as required."""


class Undecided(AssistedOperator):
    """Answers touches and offers by a script first, then like the simulated person.

    ``touches`` maps the number of a touch question to the word typed in place of "done"; ``offers``
    holds the answers to offers, ``writes`` those to the questions before a write.
    """

    asked = 0
    question = ""
    touches: dict[int, list[str]]
    told: list[str]
    ahead: list[str]
    offers: list[str]
    writes: list[str]

    @classmethod
    def at(cls, cell, controller, *, touches=(), offers=(), writes=()):
        person: Any = cls.with_eyes(
            InProcessEyes(cell.cell.simulator), lambda _: None, clock=controller.clock
        )
        person.touches, person.told, person.ahead = dict(touches), [], []
        person.offers, person.writes = list(offers), list(writes)
        return person

    def tell(self, text):
        self.told.append(text)

    def ask(self, question, kind):
        super().ask(question, kind)
        self.question, self.ahead = question, []
        self.asked += kind is Question.PLACE

    def poll(self, wait_s):
        if self.ahead:
            return self.ahead.pop(0)
        word = super().poll(wait_s)
        if word == "done" and self.asked in self.touches:
            self.ahead = list(self.touches.pop(self.asked))
            return self.ahead.pop(0)
        if word == "y":
            script = self.writes if self.question.startswith("Write") else self.offers
            return script.pop(0) if script else "n" if script is self.offers else "y"
        return word


@pytest.fixture
def cell(tmp_path, monkeypatch):
    with method_cell("epson", tmp_path, monkeypatch) as cell:
        cell.lengthen(0.0, 0.4, -0.3)
        yield cell


def change(cell, source, *, verify=False, **script):
    """Carry out the change; return the person and the measurement's result."""
    with robolink.connect(cell.cell.url) as controller:
        person = Undecided.at(cell, controller, **script)
        plan = ChangePlan((ToolPlan(1, source, verify=verify),))
        report = NozzleChange(controller, plan, operator=person).run()
    return person, report.tools[0].proposal.result


def check_written(cell, within_mm=0.06):
    apart = (cell.stored.x_mm - cell.truth.x_mm, cell.stored.y_mm - cell.truth.y_mm)
    assert math.hypot(*apart) < within_mm


def decisions(cell):
    return [str(one.verdict) for one in reversed(cell.recorded(EntryKind.DECISION))]


def test_a_touch_that_slipped_is_made_again_alone_and_the_measurement_goes_on(cell):
    # The second touch slips; at the third the person goes back to it, and the third follows.
    source = NAngleSource((180.0, 90.0, -90.0), sampling=SamplingPolicy(retake=False))
    person, result = change(cell, source, touches={2: SLIP, 3: ["again"]})
    assert person.asked == 1 + 1 + 1 + 1 + 1 + 1
    assert "Repeat touch 2." in person.told
    assert len(result.inputs) == 4
    assert [round(pose.u_deg - result.inputs[0].u_deg) % 360 for pose in result.inputs] == [
        0, 180, 90, 270,
    ]  # fmt: skip
    check_written(cell)


def test_the_first_of_two_touches_is_made_again_by_its_number(cell):
    person, result = change(cell, TwoPoseSource(), touches={1: SLIP, 2: ["again 1"]})
    assert person.asked == 4
    assert len(result.inputs) == 2
    check_written(cell)


def test_from_the_new_values_the_worst_touch_is_made_again_and_one_added(cell):
    source = NAngleSource((180.0, 90.0, -90.0, 45.0), sampling=SamplingPolicy(retake=False))
    person, result = change(cell, source, touches={3: SLIP}, writes=["back", "more"])
    assert person.asked == 5 + 1 + 1
    assert len(result.inputs) == 6
    assert result.dof == 8
    check_written(cell)
    assert len(cell.recorded(EntryKind.CALIBRATION)) == 3
    said = " / ".join(decisions(cell))
    assert said.index("touch 3 again") < said.index("one more touch") < said.index("accepted")


def test_back_from_two_poses_is_the_last_one_and_no_third_is_added(cell):
    person, result = change(cell, TwoPoseSource(), touches={2: SLIP}, writes=["more", "back"])
    assert person.asked == 3
    assert "neither yes nor no" in " ".join(person.told)
    assert len(result.inputs) == 2
    check_written(cell)


def test_one_more_touch_is_offered_where_the_worst_is_named(cell):
    source = NAngleSource((180.0, 90.0), sampling=SamplingPolicy(retake=True))
    person, result = change(cell, source, offers=["more"])
    assert person.asked == 4
    assert len(result.inputs) == 4
    check_written(cell)


def test_who_goes_back_without_end_has_to_answer_in_the_end(cell):
    before = cell.stored
    with pytest.raises(DeclinedError):
        change(cell, TwoPoseSource(), writes=["back"] * 9)
    assert cell.stored == before
    assert sum("again" in one for one in decisions(cell)) == 3


def test_a_touch_made_again_is_judged_as_any_other(cell):
    # The tip is left at its standoff, with a jog beside the pin: the heights show it.
    with pytest.raises(CalibrationError) as refused:
        change(
            cell,
            TwoPoseSource(),
            touches={3: ["z+0.1", "z+0.1", "z+0.1", "", "", "", ""]},
            writes=["back"],
        )
    assert refused.value.code == "touch_heights_differ"


def test_a_change_that_is_implausible_once_a_touch_was_made_again_is_refused(cell):
    before = cell.stored
    aside = ["x+5", "x+0.1", ""]  # half of it is the shift of the tip
    with pytest.raises(CalibrationError) as refused:
        change(cell, TwoPoseSource(), touches={3: aside}, writes=["back"])
    assert refused.value.code == "implausible_change"
    assert cell.stored == before


def changed_on_the_pin(cell, source, *, writes=(), length="keep"):
    """Change the nozzle on a named pin; ``source`` may need the controller."""
    with robolink.connect(cell.cell.url) as controller:
        person = Undecided.at(cell, controller, writes=writes)
        tool = ToolPlan(1, source(controller), verify=False, pin="PIN-07", length=length)
        NozzleChange(controller, ChangePlan((tool,)), operator=person).run()


def test_a_length_that_changed_is_followed_also_where_a_touch_was_made_again(cell):
    changed_on_the_pin(cell, lambda _: TwoPoseSource())
    before = cell.stored
    cell.lengthen(0.6)
    changed_on_the_pin(cell, lambda _: TwoPoseSource(), writes=["back"], length="difference")
    assert cell.stored.z_mm - before.z_mm == pytest.approx(-0.6, abs=0.2)


def test_one_touch_that_is_made_again_starts_from_what_is_stored(cell):
    """Starting from its first proposal, it would add the same difference again."""

    def compared(controller):
        last = partial(difference_from_last, controller, 1, "PIN-07", sigma_mm=0.03)
        return OneTouchSource(last(limits=NeedleLimits()))

    changed_on_the_pin(cell, lambda _: TwoPoseSource())
    cell.lengthen(0.4, 0.5, -0.4)
    changed_on_the_pin(cell, compared, writes=["back"])
    check_written(cell, within_mm=0.2)


def test_stations_that_were_found_with_a_tool_are_named_before_it_is_written(cell):
    from robolink.calibration_run._station_check import found_with
    from robolink.stations import Found, StationKind, station_entry

    with robolink.connect(cell.cell.url) as controller:
        for name, tool in (("PIN-07", 1), ("PIN-08", 2), ("PIN-09", 1), ("PIN-09", 3)):
            found = Found(id=name, kind=StationKind.PIN, x_mm=300.0, y_mm=100.0, tool=tool)
            controller.outcomes.append(station_entry(found))
        assert found_with(controller, [1, 2]) == {1: ("PIN-07",), 2: ("PIN-08",)}
