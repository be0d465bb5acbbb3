"""Model and program make the same of commands that are drawn, right, wrong and damaged."""

import pytest
from robolink_simulators.softmotion.mailbox.plc import Plc

from tests.unit.structured_text import _behaviours as b
from tests.unit.structured_text._drawn import drawn_commands

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
