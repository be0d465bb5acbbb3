"""Model and program make the same of what is drawn: commands, right or wrong, and owners."""

import pytest
from robolink_simulators.softmotion.mailbox.plc import Plc

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


HANDED_ON = (100, 101, 102, 103, 104, 105, 107, 108, 109, 110, 111, 112, 114, 115, 118, 119)
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
