"""The cell on paper: what it answers follows from where the tip is, and from nothing else."""

import pytest

from robolink.errors import CalibrationError
from robolink.methods import measure_camera, measure_two_pose
from robolink.model import InputEdge, Path, Pose, ToolOffset
from robolink.procedures import LookPlan, TouchPlan
from robolink.runner import Ask, Confirm, Look, Move, Notify, Seek, TeachPrompt, TouchedAt
from robolink.stations import CameraStation
from robolink.testing import PaperCell

HERE = Pose(300.0, 100.0, 20.0, 90.0, tool=0)
TIP = ToolOffset(12.0, -4.0, -20.0)


def answers(*steps):
    """Return what came of each step, or the code with which it was refused."""
    heard = []
    for step in steps:
        try:
            heard.append((yield step))
        except CalibrationError as error:
            heard.append(error.code)
    return heard


def down(number, *, falling=False):
    """Seek from where the tip is to 10 mm beneath."""
    target = Pose(300.0, 100.0, 10.0, 90.0, tool=0)
    return Seek(target, InputEdge(number, falling=falling), 2.0, "down")


def test_a_touch_brings_the_tip_to_the_pin_without_turning_the_tool():
    (touch,) = PaperCell(HERE, TIP, (310.0, 95.0, -40.0)).run(answers(Ask("touch")))
    assert isinstance(touch, TouchedAt)
    # At U = 90 the tip's X lies along the base's Y, and its Y against the base's X.
    assert touch.coordinates() == pytest.approx((306.0, 83.0, -20.0, 90.0, 0.0, 0.0))
    assert touch.seconds == 4.0
    assert touch.contact is None


def test_a_contact_input_is_seen_to_switch():
    cell = PaperCell(HERE, TIP, (310.0, 95.0, -40.0))
    (touch,) = cell.run(answers(Ask("touch", contact=InputEdge(2))))
    assert touch.contact is True


@pytest.mark.parametrize("contact", [None, InputEdge(2)])
def test_a_touch_that_nobody_describes_is_not_made(contact):
    cell = PaperCell(HERE, TIP)
    with pytest.raises(CalibrationError) as refused:
        cell.run(measure_two_pose(TouchPlan(contact=contact), stored=TIP))
    assert refused.value.code == "not_touched"


def test_a_surface_is_touched_where_the_person_comes_from():
    cell = PaperCell(HERE, TIP, lambda at: (at[0], at[1], -40.0))
    (touch,) = cell.run(answers(Ask("touch")))
    assert touch.coordinates()[:3] == pytest.approx((300.0, 100.0, -20.0))


def test_an_edge_is_found_where_the_switch_goes_over():
    cell = PaperCell(HERE, TIP, switches={5: lambda at: at[2] < -4.321})
    (found,) = cell.run(answers(down(5)))
    assert found.z_mm == pytest.approx(15.679, abs=1e-9)
    assert cell.here == found


@pytest.mark.parametrize(
    ("number", "falling", "code", "stands_mm"),
    [(5, False, "edge_passed", 20.0), (6, False, "no_edge", 10.0), (6, True, "edge_passed", 20.0)],
)
def test_an_edge_that_does_not_come_is_refused_as_at_a_robot(number, falling, code, stands_mm):
    cell = PaperCell(HERE, TIP, switches={5: lambda _at: True})
    assert cell.run(answers(down(number, falling=falling))) == [code]
    assert cell.here.z_mm == stands_mm


def test_a_mark_that_is_not_there_is_not_seen():
    camera = CameraStation(300.0, 80.0, -30.0)
    cell = PaperCell(HERE, TIP, marks={})
    assert cell.run(answers(Look("see", (0.0, 0.0)))) == ["tip_not_seen"]
    with pytest.raises(CalibrationError) as refused:
        cell.run(measure_camera(camera, LookPlan(), here=HERE, stored=TIP))
    assert refused.value.code == "tip_not_seen"


def test_axes_are_shown_as_the_tip_has_them():
    cell = PaperCell(HERE, ToolOffset(12.0, -4.0, -20.0, u_deg=-90.0))
    (along,) = cell.run(answers(Ask("go", TeachPrompt.ALONG_X)))
    assert along.coordinates()[:3] == pytest.approx((360.0, 100.0, 20.0))


def test_what_was_asked_told_and_offered_is_kept():
    cell = PaperCell(HERE, TIP)
    target = Pose(1.0, 2.0, 3.0, 4.0)
    heard = cell.run(answers(Move(target, Path.JOINT, "go"), Notify("well"), Confirm("again?")))
    assert heard == [target, None, False]
    assert cell.told == ["well"]
    assert [type(step).__name__ for step in cell.steps] == ["Move", "Notify", "Confirm"]
