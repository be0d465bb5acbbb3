"""Model and program answer with the same words (docs/reference/softmotion.md 5)."""

import pytest
from robolink_simulators.hosting.in_process import softmotion
from robolink_simulators.softmotion.mailbox.plc import Plc

from robolink.controllers import connect
from robolink.errors import RobolinkError
from robolink.protocols.mailbox import WordOrder, find_probe
from tests.unit.structured_text import _behaviours as b

RUNS = [
    (b.b01_disabled, "Kin_Scara3_Z"),
    (b.b02_errorstop, "Kin_Scara3_Z"),
    (b.b03_scara2_keeps_its_tool, "Kin_Scara2_Z"),
    (b.b04_scara2_takes_a_turned_tool, "Kin_Scara2_Z"),
    (b.b05_polar, "Kin_Polar_Z"),
    (b.b06_rrr, "Kin_Pos_RRR"),
    (b.b07_any_tool, "Kin_Gantry3"),
    (b.b07_any_tool, "Kin_Tripod_Rotary"),
    (b.b07_any_tool, "Kin_ArticulatedRobot_6DOF"),
    (b.b07_any_tool, "Kin_4AxisPalletizer"),
    (b.b07_any_tool, "Kin_5Axes"),
    (b.b07_any_tool, "Kin_Bipod_Rotary"),
    (b.b08_set_kinematics, "Kin_Scara3_Z"),
    (b.b10_enable_and_disable_twice, "Kin_Scara3_Z"),
    (b.b11_nothing_to_reset, "Kin_Scara3_Z"),
    (b.b12_a_line_ends_a_cycle_before_standby, "Kin_Scara3_Z"),
    (b.b13_a_stop_is_held, "Kin_Scara3_Z"),
    (b.b14_an_axis_alone, "Kin_Scara3_Z"),
    (b.b15_jog_about_x, "Kin_ArticulatedRobot_6DOF"),
    (b.block_of_before, "Kin_Scara3_Z"),
]
SAMPLE = {
    b.b03_scara2_keeps_its_tool,
    b.b13_a_stop_is_held,
    b.b15_jog_about_x,
    b.block_of_before,
}


def cases():
    for behaviour, kinematics in RUNS:
        marks = () if behaviour in SAMPLE else pytest.mark.soak
        name = f"{behaviour.__name__}-{kinematics}"
        yield pytest.param(behaviour, kinematics, marks=marks, id=name)


def taken(tmp_path, behaviour, kinematics, make_plc):
    bench = b.Bench(tmp_path, make_plc, kinematics)
    behaviour(bench)
    return bench.taken


@pytest.mark.parametrize(("behaviour", "kinematics"), list(cases()))
def test_model_and_program_give_the_same_words(tmp_path, behaviour, kinematics):
    model = taken(tmp_path, behaviour, kinematics, Plc)
    program = taken(tmp_path, behaviour, kinematics, b.of_program())
    assert len(model) > 1
    assert program == model


@pytest.mark.soak
def test_a_kinematics_without_orientation_image_takes_no_tool(tmp_path):
    def untold(make):
        return lambda model, parameters, options: make(b.without_image(model), parameters, options)

    ways = (untold(Plc), untold(b.of_program()))
    model, program = (
        taken(tmp_path, b.b09_no_orientation_image, "Kin_Scara3_Z", way) for way in ways
    )
    assert program == model


def high_first(text):
    """Return a text whose author laid the words of an LREAL the other way round."""
    return text.replace("* 65536.0;\n    part := TRUNC(mant);\n    w0 := DINT_TO_WORD(part);", SWAP)


SWAP = """* 65536.0;
    part := TRUNC(mant);
    w0 := w3;
    w3 := DINT_TO_WORD(part);
    part := WORD_TO_DINT(w1);
    w1 := w2;
    w2 := DINT_TO_WORD(part);"""


@pytest.mark.soak
def test_words_the_other_way_round_are_found_and_nothing_is_written(tmp_path):
    bench = b.Bench(tmp_path, b.of_program(b.sources("Kin_Scara3_Z", change=high_first)))
    probe = find_probe(bench.client.link.read_response())
    assert probe is not None
    assert probe.order is WordOrder.HIGH_FIRST
    written = writes(bench.plc)
    softmotion.register("swapped", bench.plc)
    try:
        with pytest.raises(RobolinkError, match="order"):
            connect("softmotion+sim://swapped")
    finally:
        softmotion.unregister("swapped")
    assert writes(bench.plc) == written


def writes(plc):
    return [text for _, _, text in plc.log if text.startswith("write")]
