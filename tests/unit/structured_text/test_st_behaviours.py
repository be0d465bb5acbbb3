"""Model and program answer with the same words, for the table and for random commands."""

from itertools import count

import pytest
from robolink_simulators.softmotion.mailbox.plc import Plc

from robolink.protocols.mailbox import Bits, CommandState, CoordinateSystem, ErrorClass, Opcode
from tests.unit._mailbox_client import LINE, shifted
from tests.unit.structured_text import _behaviours as b
from tests.unit.structured_text._drawn import ANSWER, drawn_commands, drawn_owners

# Model and program answer with the same words (docs/reference/softmotion.md 5).

SAMPLE = {
    b.b03_scara2_keeps_its_tool,
    b.b13_a_stop_is_held,
    b.b15_jog_about_x,
    b.block_of_before,
    b.block_of_an_epoch_of_before,
    b.jog_of_an_owner_who_lost_it,
    b.movements_of_an_owner_who_lost_it,
}


def cases():
    for behaviour, kinematics in b.RUNS:
        marks = () if behaviour in SAMPLE else pytest.mark.soak
        name = f"{behaviour.__name__}-{kinematics}"
        yield pytest.param(behaviour, kinematics, marks=marks, id=name)


@pytest.mark.parametrize(("behaviour", "kinematics"), list(cases()))
def test_model_and_program_give_the_same_words(tmp_path, behaviour, kinematics):
    model = b.taken(tmp_path, behaviour, kinematics, Plc)
    program = b.taken(tmp_path, behaviour, kinematics, b.of_program())
    assert len(model) > 1
    assert program == model


@pytest.mark.soak
@pytest.mark.parametrize(("behaviour", "kinematics"), b.RUNS, ids=b.named)
def test_they_are_the_same_over_a_network(tmp_path, behaviour, kinematics):
    model, program = (
        b.taken(tmp_path, behaviour, kinematics, make_plc, bus="modbus-tcp")
        for make_plc in (Plc, b.of_program())
    )
    assert len(model) > 1
    assert program == model


@pytest.mark.soak
def test_words_the_other_way_round_are_found_and_nothing_is_written(tmp_path):
    texts = b.sources("Kin_Scara3_Z", change=b.high_first)
    b.b16_words_the_other_way_round(tmp_path, b.of_program(texts))


def test_a_coupling_that_lacks_one_of_its_two_is_no_kinematics(tmp_path):
    def without_its_turn(text):
        return text.replace("kinematics.itfOriKin := orientationKinematics;", "")

    kinematics = "Kin_Gantry3+Kin_CAxis"
    texts = b.sources(kinematics, change=without_its_turn)
    with b.Bench(tmp_path, b.of_program(texts), kinematics) as bench:
        assert bench.tell(Opcode.SET_KINEMATICS, 11, 32) == [15, 303]


def test_a_program_that_was_exported_for_no_kinematics_sets_none(tmp_path):
    texts = b.sources("")
    with b.Bench(tmp_path, b.of_program(texts), "Kin_Scara3_Z") as bench:
        assert bench.tell(Opcode.SET_KINEMATICS, 2, 0) == [15, 303]
        assert bench.tell(Opcode.SET_KINEMATICS, 0, 0) == [15, 303]


def cycles_in(bench, seconds):
    """Let time pass on the link and return the number of executed program cycles."""
    before = bench.plc.plc._executed.cycles
    bench.client.link.clock.sleep(seconds)
    bench.plc.advance(bench.client.link.clock.now_ns())
    return bench.plc.plc._executed.cycles - before


def test_a_stop_that_is_held_costs_no_cycles(tmp_path):
    with b.Bench(tmp_path, b.of_program()) as bench:
        bench.enable()
        bench.client.move(z=-2.0)
        bench.tell(Opcode.STOP, 0, seconds=0.4)
        assert cycles_in(bench, 4.0) < 20
        assert bench.tell(Opcode.STOP, 1) == [10, 0]
        assert bench.taken[-1][7] == 1


@pytest.mark.parametrize(("took_ms", "most", "least"), [(0, 26, 24), (5, 13, 7), (30, 3, 1)])
def test_a_slow_computer_executes_fewer_cycles_and_keeps_up(tmp_path, took_ms, most, least):
    with b.Bench(tmp_path, b.of_program()) as bench:
        bench.enable()
        bench.client.move(z=-40.0, dynamics=LINE)
        presently = count(bench.plc.now_ns, took_ms * 1_000_000)
        bench.plc.present_ns = lambda: next(presently)
        assert least <= cycles_in(bench, 0.1) <= most


# Model and program treat random commands alike, right or wrong, and owners.

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
"""Seeds in which a take-over ends something."""
END_CLASSES = [ANSWER + 8 + 2 + 3 * end for end in range(4)]
"""The places of the last ends' error classes in the recorded words."""


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
    """One movement is interrupted, once straight and once until an input; others are begun."""
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
    assert len({words[0] for words in interrupted}) == 2  # both of them, and none of the others
    assert [CommandState.ERROR, ErrorClass.MOVING] in model[11:]
