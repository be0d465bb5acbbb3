"""The sixteen conformance behaviours over the wire (docs/reference/softmotion.md 5).

Each uses a mailbox and records its words, without knowing whether the model or the program serves
it.
"""

import json
import math
from contextlib import ExitStack
from dataclasses import replace
from functools import cache
from typing import Any

import pytest
from robolink_simulators.cell.clock import ManualClock, ScaledClock
from robolink_simulators.hosting.fieldbus.modbus import serve_modbus_tcp
from robolink_simulators.hosting.in_process import softmotion
from robolink_simulators.softmotion import GroupOptions, SmcNumbers
from robolink_simulators.softmotion.mailbox import MailboxOptions, PlcOptions, SoftMotionSimulator
from robolink_simulators.softmotion.mailbox.plc import Plc
from robolink_simulators.softmotion.program.structured_plc import PROGRAM_SOURCES, StructuredPlc
from robolink_simulators.structured_text import SourceText, TextDialect

from robolink.controllers import connect
from robolink.errors import RobolinkError
from robolink.protocols.mailbox import (
    CommandState,
    CoordinateSystem,
    ExportProfile,
    Opcode,
    WordOrder,
    crc16,
    find_probe,
)
from robolink.protocols.mailbox.exports import program_texts
from robolink.transport import open_mailbox_link
from tests.unit._mailbox_client import LINE, NO_TOOL, MailboxClient, linked, shifted

HEARTBEAT, CRC = 9, 110
NUMBERS = SmcNumbers(
    no_such_movement=13001,
    tool_incompatible=13002,
    no_orientation_image=13002,
    interrupted_by_single_axis=13003,
)
OPTIONS = PlcOptions(group=GroupOptions(numbers=NUMBERS), mailbox=MailboxOptions(device_id=77))
SWITCHED_ON = {"boot_id": 3, "epoch": 8, "device_id": 77, "slots": {}}
CYCLE_S = 0.004
ABOUT_X = 0b1000
READ_MODES = ("CURRENT", "ACTIVE", "LAST")


def sources(kinematics="", profile=ExportProfile.FULL, change=lambda text: text, opcua=False):
    """Return the exported texts, altered by ``change``."""
    texts = _exported(profile, kinematics, opcua)
    kinds = dict(PROGRAM_SOURCES)
    return [
        SourceText(name, change(text), kinds.get(name, TextDialect.CODESYS))
        for name, text in texts.items()
    ]


@cache
def _exported(profile, kinematics, opcua):
    return program_texts(profile, kinematics=kinematics, read_modes=READ_MODES, opcua=opcua)


def of_program(texts=None, *, opcua=False):
    """Return a maker of PLCs that execute the exported program."""

    def make(model, parameters, options):
        name = model.kinematics.name
        given = texts or sources(name, ExportProfile(options.mailbox.profile), opcua=opcua)
        return StructuredPlc(model, parameters, options, given)

    return make


class Bench:
    """One PLC just after power-on, a client that owns it, and the recorded words."""

    def __init__(self, folder, make_plc=Plc, kinematics="Kin_Scara3_Z", options=OPTIONS, bus="sim"):
        state = folder / f"{len(list(folder.iterdir()))}.json"
        document = {"schema": "robolink/plc-state/1", "machine": kinematics, "memory": SWITCHED_ON}
        state.write_text(json.dumps(document))
        self.plc = SoftMotionSimulator(
            kinematics, options=options, state_path=state, make_plc=make_plc
        )
        self._served = ExitStack()
        self.client = self._connected(bus)
        self.client.take()
        self.taken = []

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._served.close()

    def _connected(self, bus):
        """Connect to the PLC in this process or over TCP, in either case on a stopped clock."""
        if bus == "sim":
            return linked(self.plc)
        clock = ManualClock()
        host = serve_modbus_tcp(self.plc, clock=ScaledClock(base=clock))
        self._served.enter_context(host)
        link = open_mailbox_link(host.url, clock=clock)
        self._served.callback(link.close)
        return MailboxClient(link)

    def note(self, seconds=0.05):
        """Record the words once everything has stopped, except heartbeat and checksum."""
        self.client.wait(seconds)
        words = list(self.client.link.read_response())
        assert crc16(words[:CRC]) == words[CRC]
        words[HEARTBEAT] = words[CRC] = 0
        self.taken.append(words)

    def tell(self, opcode, *operands, seconds=0.05, **fields):
        self.client.tell(opcode, *operands, **fields)
        self.note(seconds)
        return self.taken[-1][2:4]

    def enable(self):
        assert self.tell(Opcode.ENABLE) == [CommandState.DONE, 0]

    def set_tool(self, *tool):
        """Write slot 2 and select it; return state and error class of the selection."""
        pose = (*tool, *NO_TOOL)[:6]
        assert self.tell(Opcode.WRITE_TOOL, 2, pose=pose, name="tip") == [CommandState.DONE, 0]
        self.tell(Opcode.SELECT_TOOL, 2)
        return self.taken[-1][2:4]

    def set_anew(self, *tool):
        """Write the selected slot with another tool."""
        pose = (*tool, *NO_TOOL)[:6]
        return self.tell(Opcode.WRITE_TOOL, 2, pose=pose, name="tip")

    def read_tool(self):
        self.tell(Opcode.READ_TOOL, 0)
        self.taken.append(list(self.client.link.read_slot(2)))

    def states(self, count):
        """Record the state of the group in the middle of each cycle."""
        clock = self.client.link.clock
        for _ in range(count):
            clock.sleep(1.5 * CYCLE_S - clock.now_ns() / 1e9 % CYCLE_S)
            self.client.beat()
            self.taken.append(self.client.link.read_response()[7])


def b01_disabled(bench):
    assert bench.set_tool(0.0, 0.0, 50.0) == [15, 201]
    bench.read_tool()


def b02_errorstop(bench):
    bench.enable()
    bench.set_tool(0.0, 0.0, 20.0)
    bench.plc.panel.fail_axis(1)
    assert bench.set_anew(0.0, 0.0, 50.0) == [15, 202]
    bench.tell(Opcode.RESET)
    bench.read_tool()


def b03_scara2_keeps_its_tool(bench):
    bench.enable()
    assert bench.set_tool(0.0, 0.0, 20.0) == [10, 0]
    assert bench.set_anew(10.0) == [15, 301]
    bench.read_tool()


def b04_scara2_takes_a_turned_tool(bench):
    bench.enable()
    assert bench.set_tool(0.0, 0.0, -35.0, 10.0, 20.0, 30.0) == [10, 0]
    bench.read_tool()


def b05_polar(bench):
    bench.enable()
    assert bench.set_tool(0.0, 1.0, 0.0) == [15, 301]
    assert bench.set_tool(0.0, 0.0, 1.0) == [10, 0]


def b06_rrr(bench):
    bench.enable()
    assert bench.set_tool(0.0, 0.0, 0.0, 15.0, 30.0, 45.0) == [10, 0]
    assert bench.set_anew(0.0, 0.0, 1.0, 15.0, 30.0, 45.0) == [15, 301]
    bench.read_tool()


def b07_any_tool(bench):
    bench.enable()
    assert bench.set_tool(1.0, 2.0, 3.0, 4.0, 5.0, 6.0) == [10, 0]
    bench.read_tool()


def b08_set_kinematics(bench):
    bench.enable()
    bench.set_tool(0.0, 0.0, 20.0)
    code = bench.taken[-1][88]
    assert bench.tell(Opcode.SET_KINEMATICS, code & 0xFF, code >> 8) == [10, 0]
    bench.read_tool()


def reads_of_no_movement(bench):
    """Not one of the sixteen: reads of a missing movement, before and after an existing one."""
    bench.enable()
    for mode in (1, 0, 2, 0, 1):
        assert bench.tell(Opcode.READ_TOOL, mode) == ([15, 206] if mode else [10, 0])
    bench.client.end_of(bench.client.move(z=-2.0).ack_head)
    for mode in (1, 2, 0):
        bench.tell(Opcode.READ_TOOL, mode)


def read_of_what_was_interrupted(bench):
    """Not one of the sixteen: an interrupted movement goes on with its earlier tool."""
    bench.enable()
    bench.set_tool(0.0, 0.0, 20.0)
    bench.client.move(z=-40.0, dynamics=LINE)
    bench.client.wait(0.1)
    bench.tell(Opcode.INTERRUPT, seconds=0.3)
    bench.client.done(Opcode.WRITE_TOOL, 3, pose=(1.0, 2.0, 3.0, 0.0, 0.0, 0.0))
    bench.client.done(Opcode.SELECT_TOOL, 3)
    read = [bench.client.done(Opcode.READ_TOOL, mode).answer.pose[2] for mode in (1, 0, 1)]
    assert read == [20.0, 3.0, 20.0]
    bench.tell(Opcode.STOP, 0, seconds=0.2)
    bench.tell(Opcode.STOP, 1)
    assert bench.tell(Opcode.READ_TOOL, 1) == [15, 206]
    bench.taken = [words[:12] + words[88:] for words in bench.taken[3:]]  # where it differs


def refused_kinematics(bench):
    """Not one of the sixteen: unknown codes, and codes of another machine."""
    for codes, error_class in ((18, 0), 111), ((2, 300), 111), ((-1, 0), 111), ((0, 0), 303):
        assert bench.tell(Opcode.SET_KINEMATICS, *codes) == [15, error_class]
    assert bench.tell(Opcode.SET_KINEMATICS, 2, 255) == [15, 303]
    bench.read_tool()


def b09_no_orientation_image(bench):
    bench.enable()
    assert bench.set_tool(1.0) == [15, 302]
    assert bench.set_tool(0.0, 0.0, 1.0) == [15, 302]


def b10_enable_and_disable_twice(bench):
    bench.enable()
    assert bench.tell(Opcode.ENABLE) == [15, 209]
    bench.tell(Opcode.DISABLE)
    assert bench.tell(Opcode.DISABLE) == [15, 201]


def b11_nothing_to_reset(bench):
    bench.enable()
    assert bench.tell(Opcode.RESET) == [15, 205]


def b12_a_line_ends_a_cycle_before_standby(bench):
    bench.enable()
    bench.client.move(z=-2.0, dynamics=(20.0, 500.0, 500.0, 10000.0))
    bench.states(50)
    bench.note()
    assert bench.taken[-1][96:98] == [bench.client.sequence, 10]


def b13_a_stop_is_held(bench):
    bench.enable()
    bench.client.move(z=-40.0, dynamics=LINE)
    bench.client.wait(0.1)
    assert bench.tell(Opcode.STOP, 0, seconds=0.4) == [10, 0]
    assert bench.taken[-1][7] == 4
    bench.client.move(z=-5.0)
    bench.note()
    assert bench.taken[-1][2:4] == [15, 203]
    assert bench.tell(Opcode.STOP, 1) == [10, 0]
    assert bench.taken[-1][7] == 1


def b14_an_axis_alone(bench):
    bench.enable()
    bench.plc.panel.move_axis(0, bench.plc.plc.group.values[0] + 0.5)
    bench.client.wait(0.5)
    bench.note()
    assert bench.taken[-1][7] == 1
    bench.client.move(z=-40.0)
    bench.client.wait(0.1)
    try:
        bench.plc.panel.move_axis(0, 0.0)
    except ValueError:
        bench.note()
    assert bench.taken[-1][7] == 5
    assert bench.taken[-1][96:99] == [bench.client.sequence, 14, 602]


def b15_jog_about_x(bench):
    bench.enable()
    system = CoordinateSystem.MCS
    before = bench.client.now().tcp
    dynamics = (0.1, 0.5, 0.5, 0.5)
    bench.client.tell(Opcode.JOG, ABOUT_X, 0, system, dynamics=dynamics)
    bench.client.wait(0.3)
    bench.client.tell(Opcode.JOG, 0, 0, system, dynamics=dynamics)
    bench.client.wait(0.3)
    after = bench.client.now().tcp
    assert max(abs(a - b) for a, b in zip(before[:3], after[:3], strict=True)) < 1e-6
    assert before[3:] != after[3:]
    bench.client.tell(Opcode.JOG, ABOUT_X, ABOUT_X, system, dynamics=dynamics)
    bench.note()
    assert bench.client.now().tcp == after


def block_of_before(bench):
    """Not one of the sixteen: docs/reference/mailbox.md, "When a command counts"."""
    client = bench.client
    first = client.command(Opcode.WRITE_TOOL, 3, pose=(1.0, 2.0, 3.0, 0.0, 0.0, 0.0))
    for command in (first, client.command(Opcode.CLEAR_TOOL, 3), first):
        client.write(command)
        bench.note()
    assert client.slot(3).counter == 2
    for jump in (0x7FFF, 0x7FFF, 1):  # past 65535
        client.sequence = (client.sequence + jump - 1) % 0xFFFF
        bench.read_tool()
    assert client.now().ack_head < 10


def block_of_an_epoch_of_before(bench):
    """Not one of the sixteen: docs/reference/mailbox.md, "Owners"."""
    client = bench.client
    for refusal, takes in ((107, client.take), (106, lambda: taken_over(bench))):
        late = client.command(Opcode.WRITE_TOOL, 3, pose=(1.0, 2.0, 3.0, 0.0, 0.0, 0.0))
        takes()
        client.write(replace(late, sequence=late.sequence + 9))  # ahead of all sent commands
        bench.note()
        assert bench.taken[-1][2:4] == [CommandState.ERROR, refusal]
    assert client.slot(3).counter == 0


STRANGER = 0xBADCAFE
AT_SPEED = (100.0, 1000.0, 1000.0, 10000.0)
BRAKING_MM = AT_SPEED[0] ** 2 / (2 * AT_SPEED[2])
BACK_ALONG_X = 0b1


def taken_over(bench):
    """Let another client take the mailbox by a person's decision; return it."""
    other = MailboxClient(bench.client.link, STRANGER)
    other.take(insist=1)
    return other


def moved_mm(client, since):
    """Return the distance that the TCP moves while a client sends heartbeats."""
    client.wait(2.0)
    return math.dist(client.now().tcp[:3], since)


def without_places(bench):
    """Compare no positions: in the program the answer to a block comes a cycle later."""
    bench.taken = [words[:12] + words[88:] for words in bench.taken]


def jog_of_an_owner_who_lost_it(bench):
    """Not one of the sixteen: docs/reference/mailbox.md, "What ends by itself"."""
    bench.enable()
    dynamics = {"dynamics": AT_SPEED}
    jog = bench.client.tell(Opcode.JOG, 0, BACK_ALONG_X, CoordinateSystem.MCS, **dynamics)
    bench.client.wait(0.3)
    since = bench.client.now().tcp[:3]
    assert moved_mm(taken_over(bench), since) < BRAKING_MM + 3 * CYCLE_S * AT_SPEED[0]
    bench.note()
    assert bench.taken[-1][96:99] == [jog.ack_head, 14, 106]
    assert bench.tell(Opcode.JOG, 0, 0, CoordinateSystem.MCS) == [10, 0]
    assert bench.tell(Opcode.JOG, 0, BACK_ALONG_X, CoordinateSystem.MCS, **dynamics) == [15, 106]
    without_places(bench)


def movements_of_an_owner_who_lost_it(bench):
    """Not one of the sixteen: docs/reference/mailbox.md, "What ends by itself"."""
    bench.enable()
    pose = shifted(bench.client.now().tcp, z=-150.0)
    moves = [
        bench.client.tell(opcode, *operands, pose=pose, dynamics=AT_SPEED).ack_head
        for opcode, operands in (
            (Opcode.MOVE_LINEAR, (0, 0, CoordinateSystem.MCS, 1)),
            (Opcode.MOVE_UNTIL_INPUT, (3, 1, CoordinateSystem.MCS, 1)),
        )
    ]
    bench.client.wait(0.3)
    since = bench.client.now().tcp[:3]
    assert moved_mm(taken_over(bench), since) < BRAKING_MM + 3 * CYCLE_S * AT_SPEED[0]
    bench.note()
    ends = sorted([bench.taken[-1][96:99], bench.taken[-1][99:102]])
    assert ends == [[sequence, 14, 106] for sequence in moves]
    without_places(bench)


def interrupted_movement_of_an_owner_who_lost_it(bench):
    """Not one of the sixteen: nobody can continue what another began."""
    bench.enable()
    move = bench.client.move(z=-40.0, dynamics=AT_SPEED).ack_head
    bench.client.wait(0.1)
    bench.client.done(Opcode.INTERRUPT)
    other = taken_over(bench)
    bench.note()
    assert bench.taken[-1][96:99] == [move, 14, 106]
    assert other.refused(Opcode.CONTINUE) == 206
    bench.note()
    without_places(bench)


def jog_that_another_client_ends(bench):
    """Not one of the sixteen: a client without ownership may end a jog, and its owner is told."""
    bench.enable()
    dynamics = {"dynamics": AT_SPEED}
    jog = bench.client.tell(Opcode.JOG, 0, BACK_ALONG_X, CoordinateSystem.MCS, **dynamics)
    bench.client.wait(0.3)
    other = MailboxClient(bench.client.link, STRANGER)
    since = other.now().tcp[:3]
    other.done(Opcode.JOG, 0, 0, CoordinateSystem.MCS)
    assert moved_mm(bench.client, since) < BRAKING_MM + 3 * CYCLE_S * AT_SPEED[0]
    bench.note()
    assert bench.taken[-1][96:99] == [jog.ack_head, 14, 0]
    without_places(bench)


def owner_who_leaves_and_insists(bench):
    """Not one of the sixteen: whatever i1 is, an unfinished movement is halted first."""
    bench.enable()
    move = bench.client.move(z=-150.0, dynamics=AT_SPEED).ack_head
    bench.client.wait(0.3)
    since = bench.client.now().tcp[:3]
    bench.client.settled(bench.client.tell(Opcode.OWNERSHIP, 0, 1))
    assert moved_mm(bench.client, since) < BRAKING_MM + 3 * CYCLE_S * AT_SPEED[0]
    bench.note()
    assert bench.taken[-1][96:99] == [move, 14, 0]
    without_places(bench)


def high_first(text):
    """Return a text whose author stored the words of an LREAL in the other order."""
    return text.replace("* 65536.0;\n    part := TRUNC(mant);\n    w0 := DINT_TO_WORD(part);", SWAP)


SWAP = """* 65536.0;
    part := TRUNC(mant);
    w0 := w3;
    w3 := DINT_TO_WORD(part);
    part := WORD_TO_DINT(w1);
    w1 := w2;
    w2 := DINT_TO_WORD(part);"""


def b16_words_the_other_way_round(folder, make_plc):
    """Check that the driver detects it and writes nothing."""
    with Bench(folder, make_plc) as bench:
        probe = find_probe(bench.client.link.read_response())
        assert probe is not None
        assert probe.order is WordOrder.HIGH_FIRST
        written = _writes(bench.plc)
        softmotion.register("swapped", bench.plc)
        try:
            with pytest.raises(RobolinkError, match="order"):
                connect("softmotion+sim://swapped")
        finally:
            softmotion.unregister("swapped")
        assert _writes(bench.plc) == written


def _writes(plc):
    return [text for _, _, text in plc.log if text.startswith("write")]


def without_image(model):
    """Return a machine whose kinematics has no orientation image."""
    kinematics = type("Untold", (type(model.kinematics),), {"orientation_image": lambda *_: None})
    untold: Any = object.__new__(kinematics)
    for name in getattr(model.kinematics, "__slots__", ()) or vars(model.kinematics):
        object.__setattr__(untold, name, getattr(model.kinematics, name))
    return replace(model, kinematics=untold)


RUNS = [
    (b01_disabled, "Kin_Scara3_Z"),
    (b02_errorstop, "Kin_Scara3_Z"),
    (b03_scara2_keeps_its_tool, "Kin_Scara2_Z"),
    (b04_scara2_takes_a_turned_tool, "Kin_Scara2_Z"),
    (b05_polar, "Kin_Polar_Z"),
    (b06_rrr, "Kin_Pos_RRR"),
    (b07_any_tool, "Kin_Gantry3"),
    (b07_any_tool, "Kin_Tripod_Rotary"),
    (b07_any_tool, "Kin_ArticulatedRobot_6DOF"),
    (b07_any_tool, "Kin_4AxisPalletizer"),
    (b07_any_tool, "Kin_5Axes"),
    (b07_any_tool, "Kin_Bipod_Rotary"),
    (b08_set_kinematics, "Kin_Scara3_Z"),
    (b08_set_kinematics, "Kin_Gantry3+Kin_CAxis"),
    (b08_set_kinematics, "Kin_Polar_Z+Kin_Wrist2"),
    (b09_no_orientation_image, "Kin_Scara3_Z"),
    (b10_enable_and_disable_twice, "Kin_Scara3_Z"),
    (b11_nothing_to_reset, "Kin_Scara3_Z"),
    (b12_a_line_ends_a_cycle_before_standby, "Kin_Scara3_Z"),
    (b13_a_stop_is_held, "Kin_Scara3_Z"),
    (b14_an_axis_alone, "Kin_Scara3_Z"),
    (b15_jog_about_x, "Kin_ArticulatedRobot_6DOF"),
    (block_of_before, "Kin_Scara3_Z"),
    (block_of_an_epoch_of_before, "Kin_Scara3_Z"),
    (reads_of_no_movement, "Kin_Scara3_Z"),
    (read_of_what_was_interrupted, "Kin_Scara3_Z"),
    (refused_kinematics, "Kin_Gantry3+Kin_CAxis"),
    (jog_of_an_owner_who_lost_it, "Kin_Scara3_Z"),
    (movements_of_an_owner_who_lost_it, "Kin_Scara3_Z"),
    (interrupted_movement_of_an_owner_who_lost_it, "Kin_Scara3_Z"),
    (jog_that_another_client_ends, "Kin_Scara3_Z"),
    (owner_who_leaves_and_insists, "Kin_Scara3_Z"),
]
"""Each behaviour with each kinematics that it names; the sixteenth is of another kind."""


def named(value):
    """Return the part of a test's name for a behaviour or a kinematics."""
    return getattr(value, "__name__", value)


def taken(folder, behaviour, kinematics, make_plc, **served):
    """Return the words that a behaviour records on a PLC of its own."""
    if behaviour is b09_no_orientation_image:
        make_plc = untold(make_plc)
    with Bench(folder, make_plc, kinematics, **served) as bench:
        behaviour(bench)
    return bench.taken


def untold(make_plc):
    """Return a maker of the same PLC for a kinematics without an orientation image."""
    return lambda model, parameters, options: make_plc(without_image(model), parameters, options)
