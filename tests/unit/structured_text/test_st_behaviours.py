"""Model and program answer with the same words (docs/reference/softmotion.md 5)."""

from itertools import count

import pytest
from robolink_simulators.softmotion.mailbox.plc import Plc

from robolink.protocols.mailbox import Opcode
from tests.unit._mailbox_client import LINE
from tests.unit.structured_text import _behaviours as b

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
    """Let time pass on the link and return how many cycles of the program were executed."""
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
