"""What a recipe proposes of a measurement that shows more than X and Y."""

import tomllib
from dataclasses import replace
from pathlib import Path

import pytest

from robolink.calibration import CalibrationResult
from robolink.calibration_run import Proposal
from robolink.calibration_run._recipe_plan import Reference, proposed
from robolink.calibration_run._records import touch_details
from robolink.model import Pose, ToolOffset
from robolink.recipe import load_recipe
from robolink.recipe._loading import _checked

PIVOT = Path(__file__).parents[2] / "examples" / "recipes" / "five-axes-pivot.toml"

STORED = ToolOffset(12.0, -3.5, -20.0, 30.0, 5.0, 0.0)
WAS = ToolOffset(12.2, -3.4, -20.3, 30.0, 5.0, 0.0)
NOW = ToolOffset(12.5, -3.9, -19.9, 30.0, 5.0, 0.0)


def proposal_of(basis, z, typed=None):
    """Return what the pivot recipe with other rules makes of a tip found at NOW."""
    text = PIVOT.read_text().replace('"absolute"', f'"{basis}"').replace('"measured"', f'"{z}"')
    recipe, problems = _checked(tomllib.loads(text))
    assert recipe, problems
    result = CalibrationResult(
        method="pivot",
        offset=NOW,
        measured=("x_mm", "y_mm", "z_mm"),
        kept=("u_deg", "v_deg", "w_deg"),
        reference_point_mm=(0.0, 0.0, 0.0),
        sigma_gain=1.0,
        warnings=(),
        inputs=(Pose(0.0, 0.0, 0.0, 0.0),),
    )
    reference = Reference(WAS, STORED, None, "yesterday", 7) if basis == "difference" else None
    return proposed(recipe, Proposal(1, STORED, result), reference=reference, typed_z_mm=typed)


@pytest.mark.parametrize(
    ("basis", "z", "written"),
    [
        ("absolute", "measured", (12.5, -3.9, -19.9)),
        ("absolute", "kept", (12.5, -3.9, -20.0)),
        ("absolute", "typed", (12.5, -3.9, -21.0)),
        ("difference", "measured", (12.3, -4.0, -19.6)),
        ("difference", "kept", (12.3, -4.0, -20.0)),
        ("difference", "typed", (12.3, -4.0, -21.0)),
    ],
)
def test_a_pivot_writes_z_as_the_recipe_says(basis, z, written):
    made = proposal_of(basis, z, -21.0)
    assert made.offset.components()[:3] == pytest.approx(written)
    assert made.offset.components()[3:] == STORED.components()[3:]
    assert made.tip == NOW
    assert made.z_from == z


def test_a_difference_names_the_components_that_it_moved():
    assert (
        "moved by X +0.300 Y -0.500 Z +0.400 mm" in proposal_of("difference", "measured").notes[0]
    )


def test_the_next_needle_is_compared_with_the_touch_that_stood_upright():
    """Where the value that was written puts the pin depends on how the tool stood there."""
    kept = proposal_of("absolute", "kept")
    tilted = Pose(0.0, 0.0, 0.0, -60.0, 20.0, 0.0)
    upright = Pose(0.0, 0.0, 0.0, 90.0)
    off = replace(kept.offset, x_mm=kept.tip.x_mm + 0.5)
    for inputs in ((upright, tilted), (tilted, upright)):
        result = replace(kept.result, offset=off, inputs=inputs)
        details = touch_details("PIN", replace(kept, result=result))
        place = [details[name] for name in ("x_mm", "y_mm", "z_mm")]
        assert place == pytest.approx([0.0, 0.5, -0.1])
        assert details["u_deg"] == 90.0


def test_the_example_is_the_one_that_is_varied_here():
    recipe = load_recipe(PIVOT).recipe
    assert (recipe.basis, recipe.z) == ("absolute", "measured")
