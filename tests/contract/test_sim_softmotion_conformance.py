"""The behaviours of docs/reference/softmotion.md 5, seen through the mailbox."""

import math
import re
from contextlib import ExitStack
from dataclasses import dataclass

import pytest
from robolink_simulators.cell.clock import ManualClock, ScaledClock
from robolink_simulators.cell.frames import NO_TURN, axis_and_angle, zyz
from robolink_simulators.hosting.fieldbus.modbus import serve_modbus_tcp
from robolink_simulators.softmotion.mailbox import (
    MailboxOptions,
    PlcOptions,
    SoftMotionSimulator,
)

import robolink
from robolink.errors import ConfigError, RemoteProtocolError
from robolink.journal import memory_journal
from robolink.model import AxisKind, OrientationSpace
from robolink.protocols.mailbox import (
    Bits,
    CommandState,
    ErrorClass,
    GroupState,
    Kinematics,
    Opcode,
    WordOrder,
    frames_match,
    kinematics_word,
)
from robolink.transport import open_mailbox_link
from tests.unit._mailbox_client import (
    ACS,
    FACTORS,
    LINE,
    MCS,
    NO_TOOL,
    MailboxClient,
    owning,
    shifted,
)

UP = (0.0, 0.0, 50.0, 0.0, 0.0, 0.0)


@pytest.fixture(params=["sim", pytest.param("modbus-tcp", marks=pytest.mark.soak)])
def machine(request):
    """Makes a client that owns the mailbox of a new machine, by the name of its kinematics."""
    with ExitStack() as served:

        def made(kinematics):
            simulator = SoftMotionSimulator(kinematics)
            if request.param == "sim":
                return owning(simulator)[0]
            clock = ManualClock()
            host = served.enter_context(serve_modbus_tcp(simulator, clock=ScaledClock(base=clock)))
            client = MailboxClient(open_mailbox_link(host.url, clock=clock))
            served.callback(client.link.close)
            client.take()
            return client

        yield made


@pytest.fixture
def client(machine):
    """A client that owns the mailbox of a SCARA without an orientation axis."""
    return machine("Kin_Scara2_Z")


def put(client, tool, slot=2):
    """Write a slot and select it, as a client sets a tool."""
    client.done(Opcode.WRITE_TOOL, slot, pose=tool, name="probe")
    return client.tell(Opcode.SELECT_TOOL, slot)


def set_tool(client):
    return client.done(Opcode.READ_TOOL).answer.pose


def test_1_no_tool_can_be_set_in_disabled(client):
    client.done(Opcode.SELECT_TOOL, 0)
    client.done(Opcode.DISABLE)
    now = put(client, UP)
    assert (now.state, now.error_class) == (CommandState.ERROR, ErrorClass.DISABLED)
    assert now.raw_error == 11000
    assert now.group_state == GroupState.DISABLED
    assert set_tool(client) == NO_TOOL


def test_2_no_tool_can_be_set_in_errorstop_and_the_old_one_survives_the_reset():
    client, simulator = owning(kinematics="Kin_Scara2_Z")
    before = set_tool(client)
    simulator.panel.fail_axis(0)
    assert client.now().group_state == GroupState.ERRORSTOP
    now = put(client, UP)
    assert (now.state, now.error_class) == (CommandState.ERROR, ErrorClass.ERRORSTOP)
    client.done(Opcode.RESET)
    assert set_tool(client) == before
    assert client.now().group_state == GroupState.STANDBY


def test_3_a_shift_that_the_kinematics_cannot_carry_leaves_the_old_tool(client):
    old = (0.0, 0.0, 20.0, 0.0, 0.0, 0.0)
    assert put(client, old).state == CommandState.DONE
    client.done(Opcode.WRITE_TOOL, 3, pose=(10.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    assert client.refused(Opcode.SELECT_TOOL, 3) == ErrorClass.TOOL_INCOMPATIBLE
    now = client.now()
    assert (now.tool_slot, now.group_state) == (2, GroupState.STANDBY)
    assert set_tool(client) == old


def test_4_a_shift_along_z_fits_with_any_rotation(client):
    tool = (0.0, 0.0, -35.0, 10.0, 20.0, 30.0)
    assert put(client, tool).state == CommandState.DONE
    assert frames_match(set_tool(client), tool, tolerance=1e-9)


def test_5_a_polar_robot_carries_shifts_along_z_alone():
    client, _ = owning(kinematics="Kin_Polar_Z")
    assert put(client, (0.0, 1.0, 0.0, 0.0, 0.0, 0.0)).error_class == ErrorClass.TOOL_INCOMPATIBLE
    assert put(client, (0.0, 0.0, 1.0, 0.0, 0.0, 0.0)).state == CommandState.DONE


def test_6_an_arm_of_three_axes_carries_a_rotation_and_no_shift(machine):
    client = machine("Kin_Pos_RRR")
    rotation = (0.0, 0.0, 0.0, 15.0, 30.0, 45.0)
    assert put(client, rotation).state == CommandState.DONE
    assert frames_match(set_tool(client), rotation, tolerance=1e-9)
    shifted_too = (0.0, 0.0, 1.0, 15.0, 30.0, 45.0)
    assert put(client, shifted_too, slot=3).error_class == ErrorClass.TOOL_INCOMPATIBLE
    assert frames_match(set_tool(client), rotation, tolerance=1e-9)
    assert client.now().kinematics == Kinematics.POS_RRR


NAMED = [
    "Kin_Gantry3",
    "Kin_Tripod_Rotary",
    "Kin_ArticulatedRobot_6DOF",
    "Kin_4AxisPalletizer",
    "Kin_5Axes",
    "Kin_Bipod_Rotary",
]
"""The kinematics that the behaviour names; the test adds the other rows that accept all tools."""


@pytest.mark.parametrize(
    "kinematics",
    [
        *NAMED,
        *("Kin_Scara3_Z", "Kin_Scara2_Z+Kin_CAxis", "Kin_Gantry2", "Kin_HGantry2", "Kin_HGantry3"),
        *("Kin_TGantry2", "Kin_TGantry3", "Kin_Tripod_Linear", "Kin_Pos_RRR+Kin_Wrist3"),
    ],
)
def test_7_where_the_orientation_is_known_any_tool_fits(kinematics):
    client, _ = owning(kinematics=kinematics)
    tool = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)
    assert put(client, tool).state == CommandState.DONE
    assert frames_match(set_tool(client), tool, tolerance=1e-9)


@pytest.mark.parametrize(
    ("kinematics", "codes"),
    [
        ("Kin_Scara2_Z", (Kinematics.SCARA2_Z, 0)),
        ("Kin_Tripod_Linear+Kin_CAxis", (Kinematics.TRIPOD_LINEAR, Kinematics.C_AXIS)),
        ("Kin_ArticulatedRobot_6DOF", (Kinematics.ARTICULATED_6DOF, 0)),
        (f"{__name__}:RailWithImage", (Kinematics.CUSTOM, 0)),
    ],
)
def test_8_setting_the_kinematics_takes_the_tool_off_even_the_same_kinematics(kinematics, codes):
    client, _ = owning(kinematics=kinematics)
    assert set_tool(client) != NO_TOOL
    now = client.done(Opcode.SET_KINEMATICS, *codes)
    assert now.kinematics == kinematics_word(*codes)
    assert (now.tool_slot, now.answer.pose) == (0, NO_TOOL)
    assert set_tool(client) == NO_TOOL
    assert client.slot(1).defined


class Rail:
    """A user-defined kinematics of one axis that does not implement the interface."""

    kinds = (AxisKind.LINEAR,)

    def axes_to_cartesian(self, axes):
        return (axes[0], 0.0, 0.0), NO_TURN

    def cartesian_to_axes(self, flange, near):
        return (flange[0][0],)


class RailWithImage(Rail):
    """The same kinematics with the interface."""

    def get_flange_orientation_image(self, r_flange):
        return OrientationSpace.known(NO_TURN)


@pytest.mark.parametrize("x", [1.0, 0.0])
def test_9_a_kinematics_without_an_orientation_image_takes_no_tool(machine, x):
    client = machine(f"{__name__}:Rail")
    tool = (x, 0.0, 1.0 - x, 0.0, 0.0, 0.0)
    assert put(client, tool).error_class == ErrorClass.NO_ORIENTATION_IMAGE
    assert set_tool(client) == NO_TOOL
    assert client.now().kinematics == Kinematics.CUSTOM
    assert put(machine(f"{__name__}:RailWithImage"), tool).state == CommandState.DONE


def test_10_enabling_twice_and_disabling_twice_are_errors(client):
    assert client.refused(Opcode.ENABLE) == ErrorClass.WRONG_STATE
    now = client.now()
    assert (now.group_state, now.raw_error) == (GroupState.STANDBY, 11000)
    client.done(Opcode.DISABLE)
    assert client.refused(Opcode.DISABLE) == ErrorClass.DISABLED
    assert client.now().group_state == GroupState.DISABLED


def test_11_a_reset_with_nothing_to_reset_is_an_error(client):
    assert client.refused(Opcode.RESET) == ErrorClass.NOTHING_TO_RESET
    now = client.now()
    assert (now.group_state, now.raw_error) == (GroupState.STANDBY, 120)


def test_12_a_movement_is_done_in_one_cycle_and_the_group_in_standby_in_the_next():
    client, simulator = owning()
    sequence = client.move(z=5.0).ack_head
    seen: list[tuple[int, int]] = []
    while not seen or seen[-1][1] != GroupState.STANDBY:
        clock = client.link.clock
        clock.advance_to((clock.now_ns() // 4_000_000 + 1) * 4_000_000)
        with simulator.lock:
            simulator.advance(clock.now_ns())
            words = simulator.plc.response(clock.now_ns())
        seen.append((words[2], words[7]))
        if len(seen) % 50 == 0:
            client.beat()
    assert seen[-2:] == [(CommandState.DONE, GroupState.MOVING), (10, GroupState.STANDBY)]
    assert client.now().finished[0] == (sequence, CommandState.DONE, ErrorClass.NONE)


@pytest.mark.parametrize("machine", ["sim", "modbus-tcp"], indirect=True)
def test_13_a_stop_holds_until_it_is_released(client):
    client.move(z=-5.0)
    client.done(Opcode.STOP)
    assert client.now().group_state == GroupState.STOPPING
    client.wait(0.2)
    assert client.now().group_state == GroupState.STOPPING
    assert client.move(z=5.0).error_class == ErrorClass.STOPPING
    assert client.refused(Opcode.JOG, 1, 0, MCS, dynamics=LINE) == ErrorClass.STOPPING
    client.done(Opcode.STOP, 1)
    assert client.now().group_state == GroupState.STANDBY


def test_14_an_axis_moved_by_itself_breaks_a_movement_and_nothing_else():
    client, simulator = owning()
    simulator.panel.move_axis(0, 35.0)
    assert client.now().group_state == GroupState.STANDBY
    client.wait(2.0)
    sequence = client.move(z=20.0).ack_head
    with pytest.raises(ConfigError, match="alone"):
        simulator.panel.move_axis(0, 34.0)
    assert client.end_of(sequence) == (
        sequence,
        CommandState.ABORTED,
        ErrorClass.INTERRUPTED_BY_AXIS,
    )
    assert client.now().group_state == GroupState.ERRORSTOP


@dataclass(frozen=True, slots=True)
class Turn:
    """A machine that can turn its TCP about one axis of MCS, starting with the two parallel.

    Attributes:
        button: Which of A, B and C is jogged.
        axis: The axis that it turns about.
        wrist: The turn and the inclination of a Kin_5Axes at the start.
        tool: ZYZ angles that compensate for them.
    """

    button: int
    axis: tuple[float, float, float]
    wrist: tuple[float, float]
    tool: tuple[float, float, float]


# An inclination tilts about the Y axis of the wrist, which the turn brings to the X axis of MCS.
TURNS = {
    "A": Turn(3, (1.0, 0.0, 0.0), (90.0, 0.0), (-90.0, 0.0, 0.0)),
    "B": Turn(4, (0.0, 1.0, 0.0), (0.0, 0.0), (0.0, 0.0, 0.0)),
    "C": Turn(5, (0.0, 0.0, 1.0), (0.0, 0.0), (0.0, 0.0, 0.0)),
}


@pytest.fixture(params=TURNS)
def turn(request):
    """One of the three ways to turn a TCP."""
    return TURNS[request.param]


@pytest.fixture
def parallel(machine, turn):
    """A client of a machine with a long tool, whose TCP is parallel to MCS."""
    client = machine("Kin_5Axes")
    axes = (*client.now().axes[:3], *turn.wrist, 0.0)
    now = client.tell(Opcode.MOVE_DIRECT, 0, 0, ACS, 0, pose=axes, dynamics=FACTORS)
    assert client.end_of(now.ack_head).state == CommandState.DONE
    assert put(client, (30.0, 20.0, -40.0, *turn.tool)).state == CommandState.DONE
    return client


def jog(client, forward, backward):
    """Press buttons for a tenth of a second and wait until everything stops."""
    client.tell(Opcode.JOG, forward, backward, MCS, dynamics=FACTORS)
    client.wait(0.1)
    jogging = bool(client.now().bits & Bits.JOGGING)
    client.done(Opcode.JOG, 0, 0, MCS)
    client.wait(0.3)
    return jogging


def test_15_jogging_a_turn_goes_about_an_axis_of_mcs_and_keeps_the_tcp(parallel, turn):
    before = parallel.now()
    assert axis_and_angle(zyz(*before.tcp[3:]))[1] == pytest.approx(0, abs=1e-6)
    assert jog(parallel, 1 << turn.button, 0)
    after = parallel.now()
    assert after.group_state == GroupState.STANDBY
    assert after.tcp[:3] == pytest.approx(before.tcp[:3], abs=1e-6)
    axis, angle_deg = axis_and_angle(zyz(*after.tcp[3:]))
    assert axis == pytest.approx(turn.axis, abs=1e-6)
    assert 5 < angle_deg < 60
    # The flange moves round the tip of the long tool.
    assert math.dist(after.axes[:3], before.axes[:3]) > 1


def test_15_with_both_buttons_pressed_nothing_turns(parallel, turn):
    before = parallel.now()
    assert not jog(parallel, 1 << turn.button, 1 << turn.button)
    assert parallel.now().tcp == pytest.approx(before.tcp, abs=1e-9)
    assert parallel.now().axes == before.axes


@pytest.mark.parametrize("order", ["high_first", "pairs_swapped", "halves_swapped"])
def test_16_another_word_order_is_named_and_nothing_is_written(order):
    options = PlcOptions(mailbox=MailboxOptions(word_order=order))
    simulator = SoftMotionSimulator(options=options)
    meaning = re.escape(WordOrder[order.upper()].meaning)
    with (
        serve_modbus_tcp(simulator) as host,
        pytest.raises(RemoteProtocolError, match=rf"\+0 registers.*{meaning}"),
    ):
        robolink.connect(host.url, outcomes=memory_journal(host.url).log(host.url))
    assert {text for _, _, text in simulator.log} == {"read_response"}


def test_a_direct_movement_in_axis_space_ends_at_its_target(client):
    axes = client.now().axes
    target = shifted(axes, 5.0, -5.0, 10.0)
    now = client.tell(Opcode.MOVE_DIRECT, 0, 0, ACS, 0, pose=target, dynamics=FACTORS)
    assert client.end_of(now.ack_head).state == CommandState.DONE
    assert client.now().axes == pytest.approx(target, abs=1e-9)
