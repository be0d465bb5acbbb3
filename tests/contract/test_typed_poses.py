"""A pose that a person types: its permitted uses, and why it proves nothing by itself."""

from typing import Any

import pytest

import robolink
from robolink.calibration_run import ChangePlan, NozzleChange, ToolPlan
from robolink.errors import CalibrationError, VerifyError
from robolink.methods import NAngleSource, TwoPoseSource
from robolink.model import EntryKind
from tests.contract._method_cell import method_cell
from tests.contract.test_touches_made_again import Undecided

pytestmark = pytest.mark.simulator_only


@pytest.fixture
def cell(tmp_path, monkeypatch):
    with method_cell("epson", tmp_path, monkeypatch) as cell:
        cell.lengthen(0.0, 0.4, -0.3)
        yield cell


class Types(Undecided):
    """Types ``pose`` with the controller's numbers, plus the given differences."""

    group: Any

    def poll(self, wait_s):
        word = super().poll(wait_s)
        if not (word or "").startswith("pose"):
            return word
        here = self.group.pose()
        by = [float(one) for one in word.split()[1:]] or [0.0] * 4
        numbers = zip(here.coordinates()[:4], by, strict=True)
        return "pose " + " ".join(f"{at + more:.3f}" for at, more in numbers)


def change(cell, source, touches, *, verify=True):
    with robolink.connect(cell.cell.url) as controller:
        person = Types.at(cell, controller, touches=touches)
        person.group = controller.groups[0]
        plan = ChangePlan((ToolPlan(1, source, verify=verify),))
        try:
            report = NozzleChange(controller, plan, operator=person).run()
        except (CalibrationError, VerifyError) as error:
            return person, error
    return person, report.tools[0]


def test_a_typed_pose_is_marked_and_counts_once_the_turn_test_has_proved_it(cell):
    _, done = change(cell, NAngleSource((180.0, 90.0)), {2: ["pose 0.01 0 0 0"]})
    assert done.verification.passed
    assert "touches_not_witnessed" in done.proposal.result.notes
    assert "Typed, not touched: touch 2." in done.proposal.notes[0]
    (entry,) = cell.recorded(EntryKind.CALIBRATION)
    assert [touch.get("typed", False) for touch in entry.details["touches"]] == [
        False, True, False,
    ]  # fmt: skip
    assert entry.details["touches"][1]["arrival"] is None, "nothing shows that it was jogged"


def test_a_typed_pose_that_is_wrong_leaves_the_old_value(cell):
    before = cell.stored
    _, error = change(cell, TwoPoseSource(), {2: ["pose 0.9 0 0 0"]})
    assert isinstance(error, VerifyError)
    assert cell.stored == before


@pytest.mark.parametrize(
    ("typed", "verify", "said"),
    [
        (
            "pose 5 0 0 0",
            True,
            "That is 5.00 mm and 0.0 degrees from where the controller has the tool",
        ),
        ("pose 0 0 0 3", True, "That is 0.00 mm and 3.0 degrees from"),
        ("pose 0 0 0 0", False, "only at a touch that a turn test proves afterwards"),
    ],
)
def test_what_is_typed_is_held_against_where_the_robot_stands(cell, typed, verify, said):
    person, done = change(cell, TwoPoseSource(), {2: [typed, ""]}, verify=verify)
    assert said in " ".join(person.told)
    assert not any(touch.typed for touch in done.proposal.result.inputs)


def test_the_turn_test_takes_no_typed_pose(cell):
    person, done = change(cell, TwoPoseSource(), {3: ["pose 0 0 0 0", ""]})
    assert "only at a touch that a turn test proves afterwards" in " ".join(person.told)
    assert done.verification.passed


class InTheAir(Types):
    """Never jogs at the second touch, and types the pose where the robot stopped."""

    def poll(self, wait_s):
        word = super().poll(wait_s)
        if self.asked != 2 or word is None:
            return word
        return "pose " + " ".join(f"{one:.3f}" for one in self.group.pose().coordinates()[:4])


def test_a_pose_typed_where_the_robot_stopped_is_no_touch(cell):
    with robolink.connect(cell.cell.url) as controller:
        person = InTheAir.at(cell, controller)
        person.group = controller.groups[0]
        plan = ChangePlan((ToolPlan(1, TwoPoseSource()),))
        with pytest.raises(CalibrationError) as refused:
            NozzleChange(controller, plan, operator=person).run()
    assert refused.value.code == "touch_heights_differ"
