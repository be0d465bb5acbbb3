"""A whole needle change by keys on the full screen, in both ways in which Windows draws one."""

import re
import time

import pytest

BOTH = pytest.mark.parametrize("way", ["calls", "sequences"])


def scan(console, code="N-7"):
    """Scan a code as a scanner sends it: all at once, with ENTER at the end."""
    console.see("Scan the id of the new needle")
    console.rest(0.6)
    console.send(f"burst {'+'.join(code)}+enter")


def jogging(opened, way):
    """Return a console in which somebody can jog by keys."""
    console = opened(way, "robot", "jog", "--keys")
    console.see("everybody out of the cell")
    console.rest(0.6)
    console.press(["2", "5"])
    console.see("Step")
    console.rest(0.6)
    return console


@BOTH
def test_a_needle_is_changed_from_the_scan_to_done(opened, simulator, way):
    before = simulator.machine.tools.get(1)
    console = opened(way, "change", "needle.toml")
    scan(console)
    console.start()
    console.see("Touch 1 of 2")
    console.rest(0.6)
    console.press(["5"])
    console.see("Not yet: the tip is still where the robot stopped")
    console.touch()
    console.see("Touch 2 of 2")
    console.touch()
    console.see("exactly as long")
    console.rest(0.6)
    console.press(["2", "5"])
    console.see("To write, type the tool number")
    console.rest(0.6)
    assert simulator.machine.tools.get(1) == before
    console.press(["enter", "*"])
    console.see("Type the number of the tool first")
    assert simulator.machine.tools.get(1) == before
    console.press(["1", "*"])
    console.prove()
    console.see("DONE")
    console.rest(0.6)
    console.press(["0"])
    assert console.exit_code() == 0
    console.see("Needle N-7 on tool 1 is measured, written and tested.")
    after, true = simulator.machine.tools.get(1), simulator.world.tips[1]
    assert after != before
    assert abs(after.x_mm - true.x_mm) < 0.1
    assert abs(after.y_mm - true.y_mm) < 0.1
    assert simulator.machine.tools.selected == 1


@BOTH
def test_keys_without_numlock_jog_a_held_one_ends_with_its_release_and_escape_stops(
    opened, simulator, way
):
    console = jogging(opened, way)
    arm = simulator.machine.arm
    for key in ("left", "up", "pageup", "home"):
        began = arm.moves_started
        console.press([key])
        console.rest(1.0)
        assert arm.moves_started == began + 1, key
    began = arm.moves_started
    for _ in range(45):
        console.send("held right")
        console.rest(0.033)
    console.rest(1.0)
    made = arm.moves_started
    assert 1 <= made - began < 45
    console.rest(1.0)
    assert arm.moves_started == made
    console.press(["escape"])
    assert console.exit_code() == 0


@BOTH
def test_a_code_that_is_scanned_while_somebody_jogs_moves_nothing(opened, simulator, way):
    console, arm = jogging(opened, way), simulator.machine.arm
    judged = 0
    for how in ("scan 4468136931", "burst 4+6+9+enter", "scan 6842679", "burst 4+6+8+2") * 3:
        began = arm.moves_started
        if console.scanned(how):
            console.see("Looked like a scanner")
            console.rest(1.0)
            assert arm.moves_started == began, how
            judged += 1
        else:  # this computer was so busy that they came as slowly as from a hand
            console.rest(5.0)
    assert judged
    began = arm.moves_started
    console.press(["6"])
    end_s = time.monotonic() + console.longest_s
    while arm.moves_started == began and time.monotonic() < end_s:
        console.rest(0.2)
    assert arm.moves_started == began + 1


@BOTH
def test_the_screens_are_straight_in_chinese(opened, simulator, way):
    console = opened(way, "change", "needle.toml", language="zh")
    scan(console)
    console.see(r"开始移动")
    console.see(r"(?s)\n-{80} *\n.*\n-{80} *\n")
    assert sum(row.startswith("-") for row in console.text.split("\n")) == 2
    console.rest(0.6)
    console.press(["2", "5"])
    console.see("还有 1 项")
    console.press(["2", "5"])
    console.rest(1.0)
    console.press(["2", "5"])
    console.see("第 1 次触碰")
    console.rest(0.6)
    if way == "sequences":
        console.see("模拟 *\n")
        assert columns_of(console, "模拟") == (76, 80)
        assert columns_of(console, "停止")[1] == 80
    console.press(["escape"])
    console.see("已停止")
    console.rest(0.6)
    console.press(["0"])
    assert console.exit_code() == 9
    assert simulator.machine.tools.selected == 1


def columns_of(console, text):
    """Return the first and last column of a text that ends a row of the screen."""
    for number, row in enumerate(console.screen.display):
        if re.search(rf"{text}\s*$", row):
            cells = console.screen.buffer[number]
            taken = [column for column in range(100) if cells[column].data.strip()]
            last = taken[-1] + 2  # the second half of a wide character is an empty cell
            return last - 2 * len(text), last
    raise AssertionError(console.text)
