"""What of a proposal counts as its change: the lengths that were measured."""

import pytest

from robolink.calibration import CalibrationResult
from robolink.calibration_run import AcceptanceCriteria, Proposal
from robolink.errors import CalibrationError
from robolink.model import ToolOffset

BEFORE = ToolOffset(12.0, -3.5, -20.0)
XY, XYZ = ("x_mm", "y_mm"), ("x_mm", "y_mm", "z_mm")


def proposal(offset, measured, z_from="kept"):
    result = CalibrationResult(
        method="pivot",
        offset=offset,
        measured=measured,
        kept=tuple(name for name in XYZ if name not in measured),
        reference_point_mm=(),
        sigma_gain=1.0,
        warnings=(),
        inputs=(),
    )
    return Proposal(1, BEFORE, result, z_from=z_from)


@pytest.mark.parametrize(
    ("measured", "z_from", "change_mm"),
    [
        (("z_mm",), "kept", 3.0),
        (XYZ, "kept", 3.0),
        (XY, "measured", 3.0),
        (XY, "typed", 0.0),
        (XYZ, "typed", 0.0),
    ],
)
def test_a_jump_of_z_alone_is_implausible_where_z_was_measured(measured, z_from, change_mm):
    longer = proposal(ToolOffset(12.0, -3.5, -23.0), measured, z_from)
    assert longer.change_mm == pytest.approx(change_mm)
    if not change_mm:
        AcceptanceCriteria().judge_change(longer)
        return
    with pytest.raises(CalibrationError, match="would move 3") as refused:
        AcceptanceCriteria().judge_change(longer)
    assert refused.value.code == "implausible_change"


def test_the_lengths_count_together_and_only_the_plane_has_to_shrink():
    both = proposal(ToolOffset(12.6, -4.3, -21.0), XYZ)
    assert both.change_mm == pytest.approx(2**0.5)
    AcceptanceCriteria().judge_change(both, earlier_mm=[1.1])
    with pytest.raises(CalibrationError, match="The correction grew"):
        AcceptanceCriteria().judge_change(both, earlier_mm=[0.9])
