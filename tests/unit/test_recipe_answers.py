"""Where nobody can be asked, a recipe that asks is refused before anything is sent."""

import tomllib

import pytest

from robolink.errors import DeclinedError
from robolink.recipe import Answers, require_answers
from robolink.recipe._loading import _checked

RECIPE = """\
schema = "robolink/recipe/1"
name = "Needle"
basis = "absolute"
z = "{z}"
[station]
id = "PIN"
[source]
kind = "points"
[[tools]]
number = 3
points = [1, 2]
[[tools]]
number = 4
points = [3, 4]
"""
PROMPT = """\
[[prompts]]
at = "start"
text = "Which lot?"
answer = "lot"
"""


def recipe(z, more=""):
    found, problems = _checked(tomllib.loads(RECIPE.format(z=z) + more))
    assert not problems
    return found


@pytest.mark.parametrize(
    ("z", "more", "answers"),
    [
        ("kept", "", Answers(yes=True)),
        ("typed", "", Answers(z_mm={3: -20.0, 4: -21.0})),
        ("kept", PROMPT, Answers(yes=True, lot="L 7")),
    ],
)
def test_what_was_answered_beforehand_is_not_missing(z, more, answers):
    require_answers(answers, recipe(z, more))


@pytest.mark.parametrize(
    ("z", "more", "answers", "missing"),
    [
        ("kept", "", Answers(), "yes=True"),
        ("kept", PROMPT, Answers(yes=True), "lot=ID"),
        ("typed", "", Answers(yes=True, z_mm={3: -20.0}), "z_mm={4: MM}"),
    ],
)
def test_what_nobody_answered_is_named(z, more, answers, missing):
    with pytest.raises(DeclinedError) as refused:
        require_answers(answers, recipe(z, more))
    assert missing in refused.value.remedy
    assert refused.value.remedy.count("Answers(") == 1
