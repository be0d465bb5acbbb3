"""A whole change on a PLC, as it passes on the wire, and every promise about it."""

from dataclasses import replace

import pytest
from robolink_cli.prompts.operator import AssistedOperator
from robolink_simulators.control.assist import InProcessEyes
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

from robolink.calibration_run import ChangePlan, NozzleChange, ToolPlan
from robolink.controllers import Jog
from robolink.model import MotionOutcome, MotionProfile, Path, ToolOffset, WorkBox
from robolink.protocols.mailbox import Bits, GroupState, Opcode, next_number
from tests.contract._softmotion_cell import BACKENDS, QUICK, above, few_links, served
from tests.contract._softmotion_wire_promises import (
    MOVES,
    RIDES,
    WireLog,
    note_markers,
    tapped,
)

TOOL = 1
SHORT, LONG = ToolOffset(0.0, 0.0, -11.0), ToolOffset(0.0, 0.0, -12.0)
CARRIERS = [one for one in BACKENDS if one != "sim"]


def changed(cell):
    """Change the nozzle of tool 1 and return what passed on the wire."""
    with tapped() as log, cell.connect() as controller:
        note_markers(controller.outcomes, log)
        controller.motors(True)
        person = AssistedOperator.with_eyes(
            InProcessEyes(cell.simulator), lambda _text: None, clock=controller.clock
        )
        plan = ChangePlan((ToolPlan(TOOL),), ask_before_write=False)
        (report,) = NozzleChange(controller, plan, operator=person).run().tools
        assert report.verification is not None
    return log


def test_a_whole_change_keeps_every_promise():
    with served("sim") as cell:
        log = changed(cell)
    opcodes = {one.command.opcode for one in log if one.kind == "command"}
    assert opcodes >= {
        Opcode.MOVE_LINEAR,
        Opcode.MOVE_DIRECT,
        Opcode.WRITE_TOOL,
        Opcode.SELECT_TOOL,
        Opcode.READ_TOOL,
    }
    assert WireLog(log).broken() == []


@pytest.mark.parametrize(
    "kinematics", ["Kin_ArticulatedRobot_6DOF", "Kin_Gantry3+Kin_CAxis", "Kin_4AxisPalletizer"]
)
@pytest.mark.soak
def test_a_whole_change_keeps_them_on_other_machines(kinematics):
    with served("sim", SoftMotionSimulator(kinematics, seed=7)) as cell:
        assert WireLog(changed(cell)).broken() == []


@pytest.mark.soak
@pytest.mark.parametrize("carrier", CARRIERS)
def test_a_whole_change_keeps_them_on_every_link(carrier):
    with served(carrier) as cell:
        assert WireLog(changed(cell)).broken() == []


def exercised(cell, *, speed_mm_s=10.0):
    """Write, select and move, and return what passed on the wire."""
    with tapped() as log, cell.connect() as controller:
        note_markers(controller.outcomes, log)
        (group,), tools = controller.groups, controller.tools
        tools.write(2, SHORT, expected=tools.read(2))
        with controller.preserved("a test"):
            tools.select(2)
            start = group.pose()
            turned = replace(above(start, 1.0), u_deg=start.u_deg + 3.0)
            for target, profile in (
                (above(start, 2.0), QUICK),
                (turned, MotionProfile(Path.JOINT)),
                (above(start, 3.0), MotionProfile(Path.STRAIGHT, speed_mm_s=speed_mm_s)),
            ):
                motion = group.move_to(target, profile, box=WorkBox())
                assert motion.wait(timeout_s=10) is MotionOutcome.ARRIVED
            tools.write(2, LONG, expected=SHORT)
    return log


@pytest.mark.parametrize("link", few_links("modbus-tcp", "can-multicast"))
def test_moves_writes_and_selections_keep_them_on_every_link(link):
    with served(link) as cell:
        assert WireLog(exercised(cell)).broken() == []


# A log that breaks a promise is noticed, whatever the promise.


def commands(log, *opcodes):
    return [n for n, one in enumerate(log) if one.of(*opcodes)]


def look_before(log, at):
    return max(n for n, one in enumerate(log[:at]) if one.kind == "response")


def seen_otherwise(log, opcodes, **changes):
    """Let the snapshot before the last command of these show something else."""
    at = look_before(log, commands(log, *opcodes)[-1])
    now = log[at].now
    changes = {key: value(now) if callable(value) else value for key, value in changes.items()}
    return [*log[:at], replace(log[at], now=replace(now, **changes)), *log[at + 1 :]]


def sent_otherwise(log, opcodes, **changes):
    at = commands(log, *opcodes)[-1]
    command = replace(log[at].command, **changes)
    return [*log[:at], replace(log[at], command=command), *log[at + 1 :]]


def without(log, kind, *, after, count=1):
    """Leave out the first exchanges of a kind behind the last command of these."""
    at = commands(log, *after)[-1]
    left = [n for n in range(at, len(log)) if log[n].kind == kind][:count]
    return [one for n, one in enumerate(log) if n not in left]


def without_look_before(log, *opcodes):
    at = look_before(log, commands(log, *opcodes)[-1])
    return [*log[:at], *log[at + 1 :]]


def look_moved_before_marker(log):
    at = commands(log, *MOVES)[-1]
    look = look_before(log, at)
    marker = max(n for n, one in enumerate(log[:at]) if one.kind == "marker")
    moved = [one for n, one in enumerate(log) if n not in (look, marker)]
    return [*moved[:marker], log[look], log[marker], *moved[marker:]]


def without_marker_before(log, *opcodes):
    at = commands(log, *opcodes)[-1]
    marker = max(n for n, one in enumerate(log[:at]) if one.kind == "marker")
    return [*log[:marker], *log[marker + 1 :]]


def without_end(log):
    """Let no snapshot show the end of the last movement."""
    at = commands(log, *MOVES)[-1]
    sequence = log[at].command.sequence
    return [
        one
        for n, one in enumerate(log)
        if n <= at
        or one.kind != "response"
        or (
            sequence not in [end.sequence for end in one.now.finished]
            and one.now.ack_head != sequence
        )
    ]


def always_moving(log):
    at = commands(log, *MOVES)[-1]
    return [
        replace(one, now=replace(one.now, group_state=GroupState.MOVING))
        if n > at and one.kind == "response"
        else one
        for n, one in enumerate(log)
    ]


def without_in_movement(log, *kinds):
    """Leave out what is in the middle of the last movement, which takes seconds."""
    at = commands(log, *MOVES)[-1]
    end = commands(log[at + 1 :], *Opcode)[0] + at + 1
    seen = [n for n in range(at + 1, end) if log[n].kind in kinds]
    left = seen[len(seen) // 3 : -len(seen) // 3]
    return [one for n, one in enumerate(log) if n not in left]


def with_beats_of(log, change):
    return [replace(one, number=change(one.number)) if one.kind == "beat" else one for one in log]


def repeated(log):
    at = commands(log, *MOVES)[-1]
    return [*log[: at + 1], log[look_before(log, at)], log[at], *log[at + 1 :]]


def bits(*cleared, **shown):
    def change(now):
        found = now.bits
        for one in cleared:
            found &= ~one
        return found | shown.get("also", Bits(0))

    return change


BREAKS = {
    "no snapshot before a movement": lambda log: without_look_before(log, *MOVES),
    "no snapshot before a write": lambda log: without_look_before(log, Opcode.WRITE_TOOL),
    "no snapshot before a selection": lambda log: without_look_before(log, Opcode.SELECT_TOOL),
    "the snapshot is from before the marker": look_moved_before_marker,
    "a movement without a marker": lambda log: without_marker_before(log, *MOVES),
    "a write without a marker": lambda log: without_marker_before(log, Opcode.WRITE_TOOL),
    "a selection without a marker": lambda log: without_marker_before(log, Opcode.SELECT_TOOL),
    "a group that is disabled": lambda log: seen_otherwise(
        log, MOVES, group_state=GroupState.DISABLED
    ),
    "a group that moves": lambda log: seen_otherwise(log, MOVES, group_state=GroupState.MOVING),
    "no power": lambda log: seen_otherwise(log, MOVES, bits=bits(Bits.POWERED)),
    "no permit": lambda log: seen_otherwise(log, MOVES, bits=bits(Bits.PERMITTED)),
    "no permit for a write": lambda log: seen_otherwise(
        log, (Opcode.WRITE_TOOL,), bits=bits(Bits.PERMITTED)
    ),
    "a tool that is not known": lambda log: seen_otherwise(log, MOVES, bits=bits(Bits.TOOL_KNOWN)),
    "an interrupted movement": lambda log: seen_otherwise(
        log, MOVES, bits=bits(also=Bits.INTERRUPTED)
    ),
    "nobody owns it": lambda log: seen_otherwise(log, MOVES, bits=bits(Bits.OWNED)),
    "another tool": lambda log: seen_otherwise(log, MOVES, tool_slot=9),
    "another start of the PLC": lambda log: seen_otherwise(
        log, MOVES, boot_id=lambda now: next_number(now.boot_id)
    ),
    "a command for another start": lambda log: sent_otherwise(log, MOVES, boot_id=9),
    "a command for any start": lambda log: sent_otherwise(log, MOVES, boot_id=0),
    "a command of another epoch": lambda log: sent_otherwise(log, MOVES, epoch=9),
    "a command of another owner": lambda log: sent_otherwise(log, (Opcode.WRITE_TOOL,), owner=9),
    "a movement is sent twice": repeated,
    "no acknowledgement": lambda log: without(log, "response", after=MOVES, count=99),
    "no end": without_end,
    "no rest": always_moving,
    "no look at a long movement": lambda log: without_in_movement(log, "head", "response"),
    "no beat in a long movement": lambda log: without_in_movement(log, "beat"),
    "a slot that is not read back": lambda log: without(
        log, "slot", after=(Opcode.WRITE_TOOL,), count=9
    ),
    "a slot that holds something else": lambda log: sent_otherwise(
        log, (Opcode.WRITE_TOOL,), pose=(1.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    ),
    "a selection that the group does not show": lambda log: sent_otherwise(
        log, (Opcode.SELECT_TOOL,), operands=(7, 0, 0, 0)
    ),
    "a group that is not asked": lambda log: [one for one in log if not one.of(Opcode.READ_TOOL)],
    "a slot that was not read before": lambda log: [
        one
        for n, one in enumerate(log)
        if one.kind != "slot" or n > commands(log, Opcode.WRITE_TOOL)[-1]
    ],
    "beats that do not count": lambda log: with_beats_of(log, lambda _word: 0x0101),
    "beats of another epoch": lambda log: with_beats_of(log, lambda word: word ^ 0x8000),
    "a mailbox that is kept": lambda log: log[: commands(log, Opcode.OWNERSHIP)[-1]],
    "another tool in the end": lambda log: [
        *log,
        replace(log[-1], kind="response", now=replace(log[0].now, tool_slot=9)),
    ],
}


@pytest.fixture(scope="module")
def kept():
    """A log that keeps every promise."""
    with served("sim") as cell:
        return exercised(cell, speed_mm_s=1.0)


@pytest.mark.parametrize("broken", BREAKS)
def test_a_broken_promise_is_found(kept, broken):
    doctored = BREAKS[broken](kept)
    assert doctored != kept
    assert WireLog(doctored).broken()


def test_a_jog_keeps_them():
    with served("sim") as cell, tapped() as log:
        with cell.connect() as controller:
            note_markers(controller.outcomes, log)
            jog = Jog(forward=frozenset({2}), speed_mm_s=2.0)
            controller.groups[0].jog(jog, duration_s=0.5, box=WorkBox())
        assert [one for one in log if one.of(*RIDES)]
        assert WireLog(log).broken() == []
