"""A whole change of a needle at the wire: the views, the presses, and what is on the controller."""

from robolink_cli.wizard.views.records import EndView, MovingView
from robolink_simulators.control.assist import InProcessEyes

from tests.panel.job._tablet import RECIPE, at_the_wire, change


def test_a_whole_change_is_carried_out_and_proved(cell):
    simulator, url = cell
    before = simulator.machine.tools.get(1)
    ended = []

    def script(tablet):
        ended.append(change(tablet, InProcessEyes(simulator)))
        tablet.press("finish")

    code, tablet = at_the_wire(["-c", url, "change", str(RECIPE)], script)
    (end,) = ended
    assert (code, tablet.left["code"]) == (0, 0)
    assert isinstance(end, EndView)
    assert end.done
    assert end.after_mm is not None
    assert end.before_mm is not None
    assert end.after_mm < 0.1 < end.before_mm
    after, tip = simulator.machine.tools.get(1), simulator.world.tips[1]
    assert abs(after.x_mm - before.x_mm) + abs(after.y_mm - before.y_mm) > 0.2
    assert abs(after.x_mm - tip.x_mm) < 0.1 > abs(after.y_mm - tip.y_mm)
    moving = [one for one in tablet.views if isinstance(one.body, MovingView)]
    assert moving
    assert {one.number for one in moving} == {0}
