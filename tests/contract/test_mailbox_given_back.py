"""A client that ends while it takes or releases a PLC's mailbox leaves it to others."""

import signal

import pytest

import robolink
from robolink.checkpoints import observed
from robolink.interrupts import Interrupted, one_ending

TAKEN, GIVEN_BACK = "30005 OWNERSHIP 1", "30005 OWNERSHIP"
NEW = robolink.ToolOffset(1.5, 2.5, 3.5)


@pytest.mark.parametrize("command", [TAKEN, GIVEN_BACK])
@pytest.mark.parametrize("late", range(4))
def test_ctrl_c_while_it_is_taken_or_given_back(softmotion_sim, robolink_state, command, late):
    passed: list[str] = []

    def end_it(_point, what):
        if what == command or passed:
            passed.append(what)
        if len(passed) == late + 1:
            signal.raise_signal(signal.SIGINT)

    with one_ending(), pytest.raises(Interrupted), observed(end_it):
        with robolink.connect(softmotion_sim.url) as controller:
            controller.tools.write(3, NEW, expected=robolink.ANY)
    with robolink.connect(softmotion_sim.url) as controller:
        assert controller.tools.write(4, NEW, expected=robolink.ANY).read_back == NEW
