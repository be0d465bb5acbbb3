"""Every row of the vendor's table moves: a line and a jog through the mailbox."""

import pytest
from robolink_simulators.softmotion.catalogue import NAMES

from robolink.protocols.mailbox import CommandState, GroupState, Opcode
from tests.unit._mailbox_client import MCS, owning
from tests.unit._softmotion_rows import AXES, DOF

JOGGING = (20.0, 200.0, 200.0, 2000.0)


@pytest.mark.parametrize(
    "name", [pytest.param(it, marks=() if it in DOF else pytest.mark.soak) for it in NAMES]
)
def test_a_line_and_a_jog_along_x_move_the_tcp_along_x_alone(name):
    client, _ = owning(kinematics=name)
    before = client.now()
    sequence = client.move(x=-2.0).ack_head
    assert client.end_of(sequence).state == CommandState.DONE
    moved = client.now()
    assert moved.tcp[0] == pytest.approx(before.tcp[0] - 2.0, abs=1e-5)
    assert moved.tcp[1:3] == pytest.approx(before.tcp[1:3], abs=1e-5)
    client.tell(Opcode.JOG, 1, 0, MCS, dynamics=JOGGING)
    client.wait(0.1)
    client.done(Opcode.JOG, 0, 0, MCS)
    client.wait(0.3)
    jogged = client.now()
    assert jogged.group_state == GroupState.STANDBY
    assert 0.5 < jogged.tcp[0] - moved.tcp[0] < 5.0
    assert jogged.tcp[1:3] == pytest.approx(moved.tcp[1:3], abs=1e-3)
    assert moved.axis_count == AXES.get(name, moved.axis_count)
