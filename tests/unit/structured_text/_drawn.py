"""Random commands and owners for a mailbox."""

import random
from typing import Any

from robolink.protocols.mailbox import (
    COMMAND_WORDS,
    Bits,
    CommandState,
    CoordinateSystem,
    GroupState,
    Opcode,
    crc16,
    encode_command,
    heartbeat_word,
)
from tests.unit._mailbox_client import FACTORS, LINE, MailboxClient, shifted

STATE, BITS, RAW, CRC = 7, 8, 4, 61
HEARTBEAT, ANSWER, AFTER_PLACES = 9, 12, 88
NUMBERS = (0, 0, 1, 1, 2, 3, 15, 16, -1, 31, 32, 255)
LENGTHS = (0.0, 1.5, -20.0, 9999.0, 10001.0, 1e300, float("inf"), float("nan"), 5e-324, -0.0)
TELLING = (2, 3, 4, 5, 11, 15, 19, 48, 49, 56, 57, 58, 59, 60)
"""Significant words: group, version, operands, the highest of a length, name, owner to reserve."""
WEIGHTED = [*Opcode, Opcode.WRITE_TOOL, Opcode.SELECT_TOOL, Opcode.READ_TOOL, Opcode.CLEAR_TOOL]


def drawn_words(draw: random.Random, client, now):
    """Return one block: usually a command that the mailbox could carry out."""
    opcode = draw.choice(WEIGHTED)
    operands = [draw.choice(NUMBERS) for _ in range(draw.choice((0, 1, 1, 2, 4)))]
    pose = list(shifted(now.tcp, z=draw.choice((-1.0, -2.0, 1.0))))
    if draw.random() < 0.5:
        pose = [draw.choice((0.0, 1.0, 12.5)) for _ in range(6)]
    if draw.random() < (0.5 if opcode is Opcode.WRITE_TOOL else 0.2):
        pose[draw.randrange(6)] = draw.choice(LENGTHS)
    if opcode in (Opcode.MOVE_LINEAR, Opcode.MOVE_DIRECT, Opcode.MOVE_UNTIL_INPUT):
        operands = [draw.choice((0, 3, 40)), 0, draw.choice((1, 1, 0, 6)), draw.choice((0, 1, 6))]
    if opcode is Opcode.SET_KINEMATICS:  # the model accepts all that fit its drives
        operands = list(draw.choice(((2, 0), (2, 32), (2, 255), (0, 0), (200, 0), (-1, 0))))
    if opcode is Opcode.JOG:
        operands = [draw.choice((0, 64, -1)), 0, draw.choice((1, 6))]  # presses no button
    fields: dict[str, Any] = {
        "pose": tuple(pose),
        "dynamics": FACTORS if opcode is Opcode.MOVE_DIRECT else LINE,
        "name": draw.choice(("", "tip", "a nozzle of 16 c")),
    }
    if draw.random() < 0.1:
        fields["owner"] = draw.choice((0, 7))
    if draw.random() < 0.05:
        fields["boot_id"] = draw.choice((1, 3, 9))
    words = list(encode_command(client.command(opcode, *operands, **fields)))
    if draw.random() < 0.4:
        place = draw.choice((*TELLING, draw.randrange(6, CRC)))
        if opcode is Opcode.JOG and place in (4, 5):
            place = 3  # no button: the distance of a jog is tested elsewhere
        words[place] = draw.choice((0, 1, 0x7F41, 0x417F, 0x7FF0, 0x40C3, draw.randrange(0x10000)))
        if draw.random() < 0.7:
            words[CRC] = crc16(words[:CRC])
    client.beats += 1
    words[CRC + 1] = heartbeat_word(client.epoch, client.beats)
    assert len(words) == COMMAND_WORDS
    return words


def drawn_commands(seed: int, commands: int):
    """Return a behaviour: each command of a seed, and all words once nothing is under way."""

    def behaviour(bench):
        draw = random.Random(seed)
        bench.enable()
        client = bench.client
        for _ in range(commands):
            permitted = draw.random() < 0.9
            if not permitted:
                bench.plc.panel.withdraw_permit()
            now = client.after_a_cycle()
            client.link.write_command(drawn_words(draw, client, now))
            client.wait(0.1)
            for _ in range(40):
                if client.now().group_state != GroupState.MOVING:
                    break
                client.wait(0.5)
            else:
                _back_to(client, now.axes)
            bench.note(0.4)
            bench.plc.panel.give_permit()
            words = bench.taken[-1]
            if words[RAW + 1] == 0xFFFF:
                words[RAW : RAW + 2] = 0, 0  # an unknown number (error_numbers.py)
            bench.taken.append(bench.plc.panel.tool_changed)
            bench.plc.panel.take_change_back()
            bench.taken.append([list(client.link.read_slot(n)) for n in (1, 2, 3, 15)])
            if words[STATE] != GroupState.STANDBY or not words[BITS] & Bits.OWNED:
                _bring_back(bench)

    return behaviour


def _back_to(client, axes):
    """End an endless movement, and return to its start.

    Its place at any moment depends on the cycle in which it began, which is not compared.
    """
    client.settled(client.tell(Opcode.HALT))
    began = (0, 0, CoordinateSystem.ACS, 0)
    told = client.tell(Opcode.MOVE_DIRECT, *began, pose=axes, dynamics=FACTORS)
    assert client.end_of(told.ack_head).state == CommandState.DONE


def _bring_back(bench):
    """Bring the group into Standby again, with the mailbox owned, for the next command."""
    bench.client.after_a_cycle()
    bench.client.take(insist=1)
    if bench.client.now().group_state == GroupState.STANDBY:
        return
    for opcode in (Opcode.STOP, Opcode.RESET, Opcode.ENABLE):
        bench.tell(opcode, *([1] if opcode is Opcode.STOP else []))


ACTS = ("take", "take", "jog", "move", "until", "direct", "end", "interrupt", "continue")
RARE_ACTS = ("halt", "stop", "release", "release", "leave", "permit")
SLOWLY = (5.0, 50.0, 50.0, 500.0)
BACK_ALONG_X = 0b1


def drawn_owners(seed: int, acts: int):
    """Return a behaviour: three clients who take the mailbox from each other during movements.

    Each act is usually the owner's, otherwise a random client's; the owner then sends a heartbeat.
    """

    def behaviour(bench):
        draw = random.Random(seed)
        bench.enable()
        others = (MailboxClient(bench.client.link, owner) for owner in (0x111, 0x222))
        clients = [bench.client, *others]
        for _ in range(acts):
            holder = bench.plc.plc.program.holder
            owning = [one for one in clients if one.owner == holder]
            act = draw.choice((*ACTS, draw.choice(RARE_ACTS)))
            now = bench.client.now()
            if now.group_state == GroupState.STOPPING and draw.random() < 0.7:
                act = "release"  # nothing else has an effect
            if now.bits & Bits.INTERRUPTED:
                act = draw.choice(("take", "continue", "end", "halt", "leave", "move", "until"))
            by_owner = owning and act != "take" and draw.random() < 0.8
            client = draw.choice(owning if by_owner else clients)
            client.sequence = max(one.sequence for one in clients)
            _act(draw, bench, client, act)
            holder = bench.plc.plc.program.holder
            beating = next((one for one in clients if one.owner == holder), client)
            beating.wait(draw.choice((0.2, 0.4)))
            words = list(client.link.read_response())
            words[RAW : RAW + 2] = 0, 0  # an unknown number (error_numbers.py)
            words[HEARTBEAT] = 0
            bench.taken.append(words[:ANSWER] + words[AFTER_PLACES:-2])  # without the checksum

    return behaviour


def _act(draw: random.Random, bench, client, act):
    system = CoordinateSystem.MCS
    tcp = client.now().tcp
    if act == "take":
        now = client.tell(Opcode.OWNERSHIP, 1, draw.choice((1, 1, 0)))
        if now.answer.holder == client.owner:
            client.epoch = now.answer.epoch
    elif act == "jog":
        client.tell(Opcode.JOG, 0, BACK_ALONG_X, system, dynamics=SLOWLY)
    elif act == "move":
        client.move(z=draw.choice((-15.0, 15.0)), mode=draw.choice((0, 1)), dynamics=SLOWLY)
    elif act == "until":
        operands = (3, 0, system, 0)
        client.tell(Opcode.MOVE_UNTIL_INPUT, *operands, pose=shifted(tcp, z=-2.0), dynamics=SLOWLY)
    elif act == "direct":
        slow = (0.1, 0.1, 0.1, 0.1)
        client.tell(Opcode.MOVE_DIRECT, 0, 0, system, 0, pose=shifted(tcp, z=2.0), dynamics=slow)
    elif act == "permit":
        bench.plc.panel.withdraw_permit()
        client.wait(0.05)
        bench.plc.panel.give_permit()
    else:
        client.tell(*_TELLING_ACTS[act])


_TELLING_ACTS = {
    "end": (Opcode.JOG, 0, 0, CoordinateSystem.MCS),
    "interrupt": (Opcode.INTERRUPT,),
    "continue": (Opcode.CONTINUE,),
    "halt": (Opcode.HALT,),
    "stop": (Opcode.STOP, 0),
    "release": (Opcode.STOP, 1),
    "leave": (Opcode.OWNERSHIP, 0, 1),
}
