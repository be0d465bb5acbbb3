"""What the marker of a change keeps of its turn tests, and what is read back from it."""

import json
import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import pytest

from robolink.calibration_run import (
    AcceptanceCriteria,
    ChangePlan,
    Limits,
    NozzleChange,
    Proposal,
    ToolPlan,
)
from robolink.calibration_run import _open_turn_test as marking
from robolink.calibration_run._measurement import offer_of
from robolink.methods import TwoPoseSource, measure_two_pose
from robolink.model import Marker, MarkerKind, Pose, ToolOffset, WorkBox
from robolink.procedures import MeasurementContext, TouchPlan
from robolink.testing import MemoryController, PaperCell

START = Pose(300.0, 100.0, 20.0, 0.0, tool=0)
FOUND = ToolOffset(12.3, -3.9, -20.0)
WRITTEN = ToolOffset(13.8, -4.4, -20.0)
"""Another one than was found: a difference to a reference."""

LIMITS = Limits(speed_mm_s=15.0)


def proposals(*tools, verify=True):
    """Return what is to be written to some tools, each measured by two poses."""
    cell = PaperCell(START, FOUND, (310.0, 95.0, -40.0))
    result = cell.run(measure_two_pose(TouchPlan(), stored=FOUND))
    criteria = AcceptanceCriteria(drift_tolerance_mm=0.35)
    proposed = replace(result, offset=WRITTEN)
    return [
        (
            ToolPlan(tool, TwoPoseSource(), criteria, verify=verify),
            Proposal(tool, FOUND, proposed, measured=FOUND),
        )
        for tool in tools
    ]


def marked(*tools, limits=LIMITS, verify=True) -> Mapping[str, Any]:
    """Return what a marker keeps, after it was a line of the record."""
    nobody: Any = None
    context = MeasurementContext(MemoryController(), nobody, start=START, settings=limits.settings)
    kept = marking.marked_turn_tests(context, limits, proposals(*tools, verify=verify))
    read: Mapping[str, Any] = json.loads(json.dumps(kept))
    return read


def read_back(kept, *tools, kind=MarkerKind.CHANGE):
    details = {**kept, "tools": {str(tool): {} for tool in tools}}
    return marking.tests_of(Marker("a1", kind, "change of a tool", "2026-01-01T00:00:00Z", details))


def test_what_is_read_back_is_the_test_with_its_limits():
    one, other = read_back(marked(1, 2), 1, 2)
    assert (one.test.tool, other.test.tool) == (1, 2)
    assert (one.test.written, one.test.tip) == (WRITTEN, FOUND)
    assert one.test.tolerance_mm == 0.35
    assert one.settings == LIMITS.settings(START, WRITTEN), "about the tip, not the flange"
    assert one.settings.speed_mm_s == 15.0


@pytest.mark.parametrize(
    ("tools", "kind"),
    [((1, 2), MarkerKind.CHANGE), ((2,), MarkerKind.CHANGE), ((1,), MarkerKind.SET)],
    ids=["a tool without a test", "a test of another tool", "another kind of marker"],
)
def test_a_change_whose_tools_are_not_all_tested_by_it_has_no_test(tools, kind):
    kept = marked(1)
    assert read_back(kept, 1)
    assert read_back(kept, *tools, kind=kind) == ()


def test_touches_are_gone_back_to_where_one_tool_was_measured_and_no_other():
    """The others were measured already, with what was mounted then."""
    assert offer_of(proposals(1))
    assert offer_of(proposals(1, 2)) is None


@pytest.mark.parametrize(("verified", "typed"), [((True, True), True), ((True, False), False)])
def test_poses_are_typed_only_where_a_test_by_touches_follows_for_each_tool(verified, typed):
    plans = [
        plan for tool, test in enumerate(verified, 1) for plan, _ in proposals(tool, verify=test)
    ]
    nobody: Any = None
    change = NozzleChange(MemoryController(), ChangePlan(tuple(plans)), operator=nobody)
    assert change._context(write=True).runner()._types is typed


@pytest.mark.parametrize(
    ("more", "why"),
    [
        ({"verify": False}, "not_wanted"),
        ({"limits": Limits(box=WorkBox(x_max_mm=math.inf))}, "no_box"),
    ],
)
def test_a_test_that_was_not_wanted_or_knows_no_limits_is_not_kept(more, why):
    kept = marked(1, **more)
    assert kept == {"untested": {"1": {"method": "two-pose", "why": why}}}
    assert read_back(kept, 1) == ()
