"""Model and program make the same of what is drawn: commands, right or wrong, and owners."""

import pytest
from robolink_simulators.softmotion.mailbox.plc import Plc

from robolink.protocols.mailbox import Bits, CommandState, CoordinateSystem, ErrorClass, Opcode
from tests.unit._mailbox_client import shifted
from tests.unit.structured_text import _behaviours as b
from tests.unit.structured_text._drawn import ANSWER, drawn_commands, drawn_owners

SCARA = "Kin_Scara3_Z"


@pytest.mark.timeout(200)
@pytest.mark.parametrize(
    ("seed", "commands"),
    [(0, 15), *(pytest.param(seed, 40, marks=pytest.mark.soak) for seed in range(1, 61))],
)
def test_drawn_commands_give_the_same_words(tmp_path, seed, commands):
    behaviour = drawn_commands(seed, commands)
    model, program = (b.taken(tmp_path, behaviour, SCARA, make) for make in (Plc, b.of_program()))
    assert len(model) > 3 * commands
    assert program == model


HANDED_ON = (100, 101, 102, 104, 105, 107, 108, 109, 110, 111, 114, 115, 118, 119, 120, 122)
"""Seeds of which a take-over ends something."""
END_CLASSES = [ANSWER + 8 + 2 + 3 * end for end in range(4)]
"""Where the error classes of the last ends stand in what was taken down."""


@pytest.mark.timeout(200)
@pytest.mark.parametrize(
    ("seed", "acts"),
    [(3, 14), *(pytest.param(seed, 40, marks=pytest.mark.soak) for seed in HANDED_ON)],
)
def test_owners_who_take_it_from_each_other_end_the_same(tmp_path, seed, acts):
    behaviour = drawn_owners(seed, acts)
    model, program = (b.taken(tmp_path, behaviour, SCARA, make) for make in (Plc, b.of_program()))
    assert len(model) > acts
    assert any(106 in [words[at] for at in END_CLASSES] for words in model[1:])
    assert program == model


SLOWLY = (20.0, 200.0, 200.0, 2000.0)


def begun_meanwhile(bench):
    """One movement is interrupted, once on a line and once until an input; others are begun."""
    bench.enable()
    client = bench.client
    client.tell(Opcode.OWNERSHIP, 1, 1)
    client.epoch = client.now().answer.epoch
    for first in (Opcode.MOVE_LINEAR, Opcode.MOVE_UNTIL_INPUT):
        operands = (3 if first is Opcode.MOVE_UNTIL_INPUT else 0, 0, CoordinateSystem.MCS, 0)
        at = client.now().tcp
        client.tell(first, *operands, pose=shifted(at, z=-30.0), dynamics=SLOWLY)
        client.wait(0.2)
        client.tell(Opcode.INTERRUPT)
        client.wait(0.3)
        bench.taken.append(shown(client))
        for mode in (1, 0):
            client.move(z=10.0, mode=mode, dynamics=SLOWLY)
            client.wait(0.05)  # a block of the program answers a cycle later
            bench.taken.append([client.now().state, client.now().error_class])
            for _ in range(3):
                client.wait(0.3)
                bench.taken.append(shown(client))
        client.tell(Opcode.HALT)
        client.wait(1.0)
        bench.taken.append(shown(client))


def shown(client):
    now = client.now()
    return [now.active_movement, now.queue_length, now.bits, now.group_state]


@pytest.mark.soak
def test_what_is_begun_while_a_movement_is_interrupted_shows_the_same(tmp_path):
    model, program = (
        b.taken(tmp_path, begun_meanwhile, SCARA, make) for make in (Plc, b.of_program())
    )
    assert len(model) == 1 + 2 * 10
    assert program == model
    interrupted = [words for words in model[1:] if len(words) == 4 and words[2] & Bits.INTERRUPTED]
    assert len(interrupted) > 6
    assert len({words[0] for words in interrupted}) == 2  # each of the two, and none of the others
    assert [CommandState.ERROR, ErrorClass.MOVING] in model[11:]
