"""Command lines are drawn from all commands, and run in a virtual cell."""

import random
from collections import Counter

import pytest
from robolink_cli.console.exit_codes import BUG, exit_code

from tests.soak.adversary import CellKind, live_through
from tests.soak.adversary.command_lines import (
    LEFT_OUT,
    drawn_commands,
    drawn_line,
    every_command,
    left_out,
)
from tests.soak.adversary.history import Deed, Habit, History, Hour


def cell_of(lines, *, kind=CellKind.EPSON):
    hours = (Hour(n, Deed.COMMAND, Habit(), (), line) for n, line in enumerate(lines))
    return live_through(History(3, kind, tuple(hours)))


def test_each_command_is_drawn_or_left_out_for_a_reason():
    every = list(every_command())
    drawn = {one.name for one in drawn_commands()}
    assert {one.name for one in every} == drawn | {one.name for one in every if left_out(one)}
    assert len(drawn) > 40
    for name in LEFT_OUT:
        assert any(f"{one.name} ".startswith(f"{name} ") for one in every), name
    for name in (
        "stop",
        "expert check-contract",
        "tool set",
        "tool clear",
        "tool restore",
        "undo",
        "recover",
        "robot jog",
        "status",
    ):
        assert name in drawn


def test_a_line_is_the_same_whenever_it_is_drawn_and_all_commands_come_up():
    lines = [drawn_line(random.Random(f"line {number}")) for number in range(1500)]
    assert lines[:50] == [drawn_line(random.Random(f"line {number}")) for number in range(50)]
    starts = {" ".join(line[:n]) for line in lines for n in (1, 2, 3)}
    assert {one.name for one in drawn_commands()} <= starts


def test_commands_do_in_a_virtual_cell_what_they_say():
    story = cell_of(
        [
            ("tool", "set", "2", "--x", "6.123456789", "--yes"),
            ("tool", "select", "2", "--yes"),
            ("robot", "jog", "z+0.5", "--yes"),
            ("undo", "--yes"),
            ("robot", "take-ownership", "--yes"),
            ("stop",),
            ("expert", "verify-controller"),
        ]
    )
    assert story.broken == [], story.told()
    done, refused = (story.endings[f"type a command: {end}"] for end in ("done", "ConfigError"))
    assert (done, refused) == (6, 1)
    # A stop and a reading of its effect use the watched wire.
    stop, look = (story.lines(hour=hour) for hour in (5, 6))
    assert any(line.endswith("> $Abort") for line in stop)
    assert any(line.endswith("> $Login") for line in look)


@pytest.mark.soak
@pytest.mark.parametrize("kind", [kind for kind in CellKind if kind is not CellKind.PROGRAM])
def test_undisturbed_commands_end_well_or_are_refused_cleanly(kind):
    lines = [drawn_line(random.Random(f"undisturbed {number}")) for number in range(60)]
    story = cell_of(lines, kind=kind)
    assert story.broken == [], story.told()
    assert story.checks["NoDefectShown"] >= len(lines)
    ends: Counter[str] = story.endings
    assert ends["type a command: done"] > len(lines) // 6


def test_what_is_no_error_of_robolink_counts_as_a_defect():
    assert exit_code(ValueError("a")) == BUG
