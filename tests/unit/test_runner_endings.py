"""What ends a procedure while a person is asked."""

import pytest

from robolink.model import ControllerStatus
from robolink.runner import EndingWatch

ON = ControllerStatus(remote=True, ready=True)


@pytest.mark.parametrize("how", ["unpowered", "disabled"])
def test_drives_that_lost_their_power_end_it_and_those_without_any_do_not(how):
    off = ControllerStatus(remote=True, **{how: True})
    watch = EndingWatch()
    assert watch.obstacle(off) == "", "a person moves the machine in another way"
    assert watch.obstacle(ON) == ""
    assert watch.obstacle(off) == "The motors went off."


def test_what_says_why_is_said_first():
    watch = EndingWatch()
    assert watch.obstacle(ON) == ""
    pressed = ControllerStatus(emergency_stop=True, unpowered=True)
    assert watch.obstacle(pressed) == "The emergency stop was pressed."
