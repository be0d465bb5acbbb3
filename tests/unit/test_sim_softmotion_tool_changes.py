"""Tool changes among queued movements: every order of buffer modes, against a table by hand.

The table is written from the two notes of the seed page about tools, and from the page of
SMC_GroupSetTool (docs/reference/softmotion.md 1.1), not from the simulator.
"""

from itertools import pairwise, product

import pytest
from robolink_simulators.softmotion import CoordRef, ReadToolMode, SmcBufferMode
from robolink_simulators.softmotion.smc_errors import BlockRefused, ErrorKind

from tests.unit._softmotion_machine import (
    FACTORS,
    in_axes,
    moved,
    passing,
    settled,
    standing,
)

A, B = SmcBufferMode.ABORTING, SmcBufferMode.BUFFERED
BLENDING = [mode for mode in SmcBufferMode if mode.blends]
LINE, DIRECT = "line", "direct"

# (movement before, movement after, tool changed between them) -> what Aborting and Blending become.
TABLE = {
    (LINE, LINE, False): {"aborting": "aborting", "blending": "blending"},
    (LINE, LINE, True): {"aborting": "buffered", "blending": "buffered"},
    (LINE, DIRECT, False): {"aborting": "aborting", "blending": "blending"},
    (LINE, DIRECT, True): {"aborting": "aborting", "blending": "buffered"},
    (DIRECT, LINE, False): {"aborting": "aborting", "blending": "blending"},
    (DIRECT, LINE, True): {"aborting": "aborting", "blending": "buffered"},
    (DIRECT, DIRECT, False): {"aborting": "aborting", "blending": "blending"},
    (DIRECT, DIRECT, True): {"aborting": "aborting", "blending": "buffered"},
}


def family(mode):
    return "blending" if mode.blends else mode.name.lower()


def becomes(before, after, mode, *, changed):
    """Return the family of what a mode becomes; Buffered stays what it is."""
    return TABLE[before, after, changed].get(family(mode), "buffered")


def command(group, how, number, mode):
    """Command the next movement of a row, each to a place of its own."""
    if how == LINE:
        return moved(group, x_mm=-6.0 * (number + 1), mode=mode)
    a0, *others = group.values
    return group.move_direct_absolute(in_axes(a0 + 2.0 * (number + 1), *others), FACTORS, mode=mode)


def tool(number):
    return CoordRef(z_mm=-10.0 * (number + 1))


def run(kinds, modes, changes):
    """Command three movements; return what each became, its tool, and how each block ended."""
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
    # Each movement keeps the tool that was in force when it was commanded.
    assert [z_mm for _, z_mm in seen] == [z_mm for _, _, z_mm in wanted]
    # What is aborted is every movement before the last one that still aborts.
    last_abort = max((n for n, became in enumerate(expected, 1) if became == "aborting"), default=0)
    assert [block.outputs.aborted for block in blocks] == [n < last_abort for n in range(3)]
    assert blocks[-1].outputs.done


@pytest.mark.parametrize("changes", [*product([True, False], repeat=2)])
@pytest.mark.parametrize("first", SmcBufferMode)
def test_every_order_of_buffer_modes_among_lines(first, changes):
    for second in SmcBufferMode:
        require_as_by_hand((LINE, LINE, LINE), (first, second), changes)


@pytest.mark.parametrize("kinds", [k for k in product([LINE, DIRECT], repeat=3) if DIRECT in k])
def test_every_order_of_kinds_of_movements(kinds):
    for changes in product([True, False], repeat=2):
        for modes in ((A, BLENDING[0]), (BLENDING[-1], A)):
            require_as_by_hand(kinds, modes, changes)


def test_between_interrupt_and_continue_the_interrupted_keep_the_old_tool():
    """The second note, and SMC_GroupGetContinueToolOffset, which tells that tool."""
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
