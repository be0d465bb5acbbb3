"""Tools of a simulated axis group, and their changes among queued movements."""

from dataclasses import dataclass
from itertools import pairwise, product

import pytest
from robolink_simulators.cell.frames import zyz
from robolink_simulators.softmotion import (
    AxisGroup,
    BlockRefused,
    CoordRef,
    ErrorKind,
    GroupOptions,
    ReadToolMode,
    SmcBufferMode,
    SmcGroupState,
    ToolInForce,
    machine_named,
)
from robolink_simulators.softmotion.kinematics.positions import Gantry

from tests._rows import each_row
from tests.unit._softmotion_machine import (
    FACTORS,
    MACHINES,
    NOZZLE,
    in_axes,
    kind,
    moved,
    passing,
    settled,
    shifted,
    standing,
)

# Tools of a simulated axis group; numbers are those of docs/reference/softmotion.md 5.

TOOL_SYMBOL = "SMC_AXIS_GROUP_TOOL_OFFSET_INCOMPATIBLE_WITH_KINEMATICS"
LIMITED = ("Kin_Scara2_Z", "Kin_Polar_Z", "Kin_Pos_RRR")
CP = "line"
DIRECT = "direct"


def set_to(group, x=0, y=0, z=0, a=0, b=0, c=0):
    return group.set_tool(CoordRef(x, y, z, a, b, c))


def shift_of(group, mode=ReadToolMode.SET):
    return group.read_tool(mode).frame.shift_mm


def commanded(group, how, *, x_mm=-20.0, mode=SmcBufferMode.BUFFERED):
    if how == CP:
        return moved(group, x_mm=x_mm, mode=mode)
    values = group.values
    return group.move_direct_absolute(in_axes(values[0] + 10, *values[1:]), FACTORS, mode=mode)


def test_no_tool_is_set_in_disabled():
    """Behaviour 1."""
    group = standing()
    group.disable()
    assert kind(set_to(group, z=50)) is ErrorKind.WRONG_STATE
    assert group.read_tool() == ToolInForce()


def test_no_tool_is_set_in_error_stop_and_the_old_one_outlives_the_reset():
    """Behaviour 2."""
    group = standing()
    set_to(group, z=20)
    group.fail_axis(0)
    assert kind(set_to(group, z=50)) is ErrorKind.WRONG_STATE
    assert shift_of(group) == (0, 0, 20)
    group.reset()
    assert shift_of(group) == (0, 0, 20)


def test_a_tool_that_does_not_fit_leaves_the_old_one():
    """Behaviour 3."""
    group = standing("Kin_Scara2_Z")
    assert set_to(group, z=20).outputs.done
    refused = set_to(group, x=10)
    assert kind(refused) is ErrorKind.TOOL_INCOMPATIBLE
    assert refused.outputs.error.symbol == TOOL_SYMBOL
    assert shift_of(group) == (0, 0, 20)
    assert group.state is SmcGroupState.STANDBY


def test_on_two_arms_a_shift_along_z_with_any_rotation_fits():
    """Behaviour 4."""
    group = standing("Kin_Scara2_Z")
    assert set_to(group, z=-35, a=10, b=20, c=30).outputs.done
    tool = group.read_tool().frame
    assert tool.shift_mm == (0, 0, -35)
    assert tool.rotation == zyz(10, 20, 30)


def test_a_polar_kinematics_takes_shifts_along_z_only():
    """Behaviour 5."""
    group = standing("Kin_Polar_Z", at=(30.0, 300.0, 0.0))
    assert kind(set_to(group, y=1)) is ErrorKind.TOOL_INCOMPATIBLE
    assert set_to(group, z=1).outputs.done


@each_row("name", [n for n in MACHINES if n not in LIMITED])
def test_a_kinematics_whose_orientation_is_known_takes_any_tool(name):
    """Behaviour 7, and a C axis behind an arm lifts its restriction.

    Source: docs/reference/softmotion.md 3.1.
    """
    group = standing(name)
    assert set_to(group, 1, 2, 3, 4, 5, 6).outputs.done
    assert shift_of(group) == (1, 2, 3)


@pytest.mark.parametrize("other", ["Kin_Scara2_Z", "Kin_Scara2_Z+Kin_CAxis"])
def test_exchanging_the_kinematics_takes_the_tool_off(other):
    """Behaviour 8, also with the same kinematics again."""
    group = standing("Kin_Scara2_Z+Kin_CAxis")
    set_to(group, 1, 2, 3)
    assert group.set_kin_transform(machine_named(other).kinematics).outputs.done
    assert group.read_tool() == ToolInForce()
    assert group.kinematics.name == other
    assert len(group.axes) == len(group.kinematics.kinds)
    assert kind(set_to(group, x=1)) is (
        ErrorKind.TOOL_INCOMPATIBLE if other == "Kin_Scara2_Z" else None
    )


@dataclass(frozen=True, slots=True)
class WithoutImage(Gantry):
    """A custom kinematics that does not implement ISMKinematicsWithOrientationImage."""

    def orientation_image(self, wanted):
        return None


@pytest.mark.parametrize("shift", [{"x": 1}, {"z": 1}])
def test_a_custom_kinematics_without_an_orientation_image_takes_no_tool(shift):
    """Behaviour 9."""
    group = AxisGroup(WithoutImage("without image"))
    group.power(on=True)
    group.enable()
    refused = set_to(group, **shift)
    assert kind(refused) is ErrorKind.NO_ORIENTATION_IMAGE
    assert refused.outputs.error.symbol == TOOL_SYMBOL
    assert moved(group, x_mm=10)


def test_the_drives_must_fit_an_exchanged_kinematics():
    group = standing("Kin_Gantry3")
    set_to(group, 1, 2, 3)
    scara = machine_named("Kin_Scara2_Z").kinematics
    assert kind(group.set_kin_transform(scara)) is ErrorKind.AXES_MISMATCH
    assert shift_of(group) == (1, 2, 3)


def test_the_kinematics_is_not_exchanged_in_motion():
    group = standing()
    moved(group, x_mm=-20)
    assert kind(group.set_kin_transform(group.kinematics)) is ErrorKind.WRONG_STATE


def test_exchanging_the_kinematics_ends_what_was_interrupted():
    group = standing()
    move = moved(group, x_mm=-60)
    passing(group, 0.2)
    group.interrupt()
    settled(group)
    group.set_kin_transform(group.kinematics)
    assert move.outputs.aborted
    assert kind(group.resume()) is ErrorKind.NO_SUCH_MOVEMENT


@pytest.mark.parametrize("allowed", [True, False])
def test_setting_a_tool_while_a_stop_is_held_is_an_option(allowed):
    group = standing(options=GroupOptions(set_tool_while_stopping=allowed))
    group.stop()
    assert kind(set_to(group, z=1)) is (None if allowed else ErrorKind.WRONG_STATE)


def test_the_reported_tcp_jumps_when_a_tool_is_set():
    group = standing()
    assert group.set_tool(NOZZLE, "needle").outputs.done
    position = group.read_actual_position()
    assert position.values[:3] == pytest.approx((316.571429, 353.185165, 20), abs=2e-6)
    assert group.read_tool().name == "needle"
    assert position.configuration.elbow_right is True
    group.set_tool(CoordRef())
    assert group.read_actual_position().values[2] == pytest.approx(-20)


def test_a_tool_counts_for_movements_commanded_after_it():
    group = standing()
    set_to(group, z=-10)
    first = moved(group, x_mm=-20)
    passing(group, 0.05)
    assert set_to(group, z=-30).outputs.done
    assert first.outputs.active
    assert shift_of(group, ReadToolMode.ACTIVE_MOVEMENT) == (0, 0, -10)
    assert shift_of(group, ReadToolMode.LAST_COMMANDED) == (0, 0, -10)
    moved(group, x_mm=-30, mode=SmcBufferMode.BUFFERED)
    assert shift_of(group, ReadToolMode.ACTIVE_MOVEMENT) == (0, 0, -10)
    assert shift_of(group, ReadToolMode.LAST_COMMANDED) == (0, 0, -30)
    assert shift_of(group) == (0, 0, -30)


@pytest.mark.parametrize("mode", [ReadToolMode.ACTIVE_MOVEMENT, ReadToolMode.LAST_COMMANDED])
def test_the_tool_of_no_movement_cannot_be_read(mode):
    with pytest.raises(BlockRefused) as caught:
        standing().read_tool(mode)
    assert caught.value.kind is ErrorKind.NO_SUCH_MOVEMENT


@pytest.mark.parametrize("kept", [True, False])
def test_whether_the_last_commanded_tool_outlives_its_movement_is_an_option(kept):
    options = GroupOptions(last_commanded_tool="kept" if kept else "unfinished")
    group = standing(options=options)
    set_to(group, z=-10)
    moved(group, x_mm=-5)
    settled(group)
    set_to(group, z=-20)
    if kept:
        assert shift_of(group, ReadToolMode.LAST_COMMANDED) == (0, 0, -10)
    else:
        with pytest.raises(BlockRefused):
            group.read_tool(ReadToolMode.LAST_COMMANDED)


@each_row("mode", [SmcBufferMode.ABORTING, SmcBufferMode.BLENDING_HIGH])
@each_row("changed", [True, False])
def test_a_tool_change_between_two_lines_makes_the_second_wait(mode, changed):
    group = standing()
    set_to(group, z=-10)
    first = moved(group, x_mm=-40)
    if changed:
        set_to(group, z=-30)
    second = moved(group, x_mm=-20, mode=mode)
    while not second.outputs.active:
        group.advance(group.next_change())
    assert first.outputs.done is changed
    settled(group)
    assert second.outputs.done


@each_row(("before", "after"), [(CP, DIRECT), (DIRECT, CP), (DIRECT, DIRECT)])
def test_a_tool_change_beside_a_direct_movement_leaves_aborting_alone(before, after):
    group = standing()
    first = commanded(group, before)
    passing(group, 0.05)
    set_to(group, z=-30)
    second = commanded(group, after, mode=SmcBufferMode.ABORTING)
    assert first.outputs.aborted
    settled(group)
    assert second.outputs.done


def test_interrupted_movements_go_on_with_their_old_tool():
    group = standing()
    set_to(group, z=-10)
    start = shifted(group)
    first = moved(group, x_mm=-60)
    second = moved(group, x_mm=-60, z_mm=5, mode=SmcBufferMode.BUFFERED)
    passing(group, 0.2)
    group.interrupt()
    settled(group)
    set_to(group, z=-30)
    assert group.resume().outputs.done
    assert shift_of(group, ReadToolMode.ACTIVE_MOVEMENT) == (0, 0, -10)
    later = moved(group, mode=SmcBufferMode.BUFFERED)
    assert shift_of(group, ReadToolMode.LAST_COMMANDED) == (0, 0, -30)
    while not second.outputs.done:
        group.advance(group.next_change())
    assert first.outputs.done
    old_tip_z_mm = group.flange().shift_mm[2] - 10
    assert old_tip_z_mm == pytest.approx(start.position[2] + 5)
    settled(group)
    assert later.outputs.done


# Tool changes among queued movements: every order of buffer modes, against a table by hand.
#
# The table is written from the two notes of the seed page about tools, and from the page of
# SMC_GroupSetTool (docs/reference/softmotion.md 1.1), not from the simulator.

A, B = SmcBufferMode.ABORTING, SmcBufferMode.BUFFERED
BLENDING = [mode for mode in SmcBufferMode if mode.blends]
LINE, DIRECT_CHANGES = "line", "direct"

# (movement before, movement after, tool changed between them) -> the result of Aborting and
# Blending.
TABLE = {
    (LINE, LINE, False): {"aborting": "aborting", "blending": "blending"},
    (LINE, LINE, True): {"aborting": "buffered", "blending": "buffered"},
    (LINE, DIRECT_CHANGES, False): {"aborting": "aborting", "blending": "blending"},
    (LINE, DIRECT_CHANGES, True): {"aborting": "aborting", "blending": "buffered"},
    (DIRECT_CHANGES, LINE, False): {"aborting": "aborting", "blending": "blending"},
    (DIRECT_CHANGES, LINE, True): {"aborting": "aborting", "blending": "buffered"},
    (DIRECT_CHANGES, DIRECT_CHANGES, False): {"aborting": "aborting", "blending": "blending"},
    (DIRECT_CHANGES, DIRECT_CHANGES, True): {"aborting": "aborting", "blending": "buffered"},
}


def family(mode):
    return "blending" if mode.blends else mode.name.lower()


def becomes(before, after, mode, *, changed):
    """Return the family that a mode turns into; Buffered stays the same."""
    return TABLE[before, after, changed].get(family(mode), "buffered")


def command(group, how, number, mode):
    """Command the next movement of a row, each to its own place."""
    if how == LINE:
        return moved(group, x_mm=-6.0 * (number + 1), mode=mode)
    a0, *others = group.values
    return group.move_direct_absolute(in_axes(a0 + 2.0 * (number + 1), *others), FACTORS, mode=mode)


def tool(number):
    return CoordRef(z_mm=-10.0 * (number + 1))


def run(kinds, modes, changes):
    """Run three movements; return each one's mode and tool, and the ends of the blocks."""
    group = standing()
    group.set_tool(tool(0))
    wanted, seen, blocks = [], [], []
    current = 0
    rows = zip(kinds, (B, *modes), (False, *changes), strict=True)
    for number, (how, mode, changed) in enumerate(rows):
        if changed:
            current = number
            assert group.set_tool(tool(current)).outputs.done
        blocks.append(command(group, how, number, mode))
        last = group.motion.queue.last
        seen.append((family(last.mode), last.tool.frame.shift_mm[2]))
        wanted.append((mode, changed, tool(current).z_mm))
        if number == 0:
            passing(group, 0.02)
    settled(group)
    return wanted, seen, blocks


def require_as_by_hand(kinds, modes, changes):
    wanted, seen, blocks = run(kinds, modes, changes)
    expected = [
        becomes(before, after, mode, changed=changed)
        for (before, after), (mode, changed, _) in zip(pairwise(kinds), wanted[1:], strict=True)
    ]
    assert [became for became, _ in seen[1:]] == expected
    # Each movement keeps the tool selected when it was commanded.
    assert [z_mm for _, z_mm in seen] == [z_mm for _, _, z_mm in wanted]
    # Every movement before the last one that still aborts is aborted.
    last_abort = max((n for n, became in enumerate(expected, 1) if became == "aborting"), default=0)
    assert [block.outputs.aborted for block in blocks] == [n < last_abort for n in range(3)]
    assert blocks[-1].outputs.done


def test_every_order_of_buffer_modes_among_lines():
    """Each pair of modes once; each mode at each place with each way to change tools."""
    ways = [*product([True, False], repeat=2)]
    for (at, first), (then, second) in product(enumerate(SmcBufferMode), repeat=2):
        require_as_by_hand((LINE, LINE, LINE), (first, second), ways[(at + then) % len(ways)])


@pytest.mark.soak
def test_every_order_of_buffer_modes_among_lines_with_each_way_to_change_tools():
    for changes in product([True, False], repeat=2):
        for modes in product(SmcBufferMode, repeat=2):
            require_as_by_hand((LINE, LINE, LINE), modes, changes)


@each_row("kinds", [k for k in product([LINE, DIRECT_CHANGES], repeat=3) if DIRECT_CHANGES in k])
def test_every_order_of_kinds_of_movements(kinds):
    for changes in product([True, False], repeat=2):
        for modes in ((A, BLENDING[0]), (BLENDING[-1], A)):
            require_as_by_hand(kinds, modes, changes)


def test_between_interrupt_and_continue_the_interrupted_keep_the_old_tool():
    """The second note, and SMC_GroupGetContinueToolOffset, which reports that tool."""
    group = standing()
    group.set_tool(tool(0))
    with pytest.raises(BlockRefused) as nothing:
        group.continue_tool_offset()
    assert nothing.value.kind is ErrorKind.NO_SUCH_MOVEMENT
    first = moved(group, x_mm=-60)
    second = moved(group, x_mm=-40, mode=B)
    passing(group, 0.1)
    group.interrupt()
    settled(group)
    group.set_tool(tool(2))
    assert group.continue_tool_offset().frame.shift_mm == (0, 0, -10)
    assert group.read_tool().frame.shift_mm == (0, 0, -30)
    group.resume()
    third = moved(group, x_mm=-20, mode=BLENDING[0])
    passing(group, 0.02)
    assert group.read_tool(ReadToolMode.ACTIVE_MOVEMENT).frame.shift_mm == (0, 0, -10)
    assert group.read_tool(ReadToolMode.LAST_COMMANDED).frame.shift_mm == (0, 0, -30)
    settled(group)
    assert all(block.outputs.done for block in (first, second, third))
