"""Findings in the history of a cell's tools, how soon they appear, and how rarely without cause."""

from collections import Counter
from dataclasses import replace
from statistics import median

import pytest

from robolink.calibration import student_t
from robolink.drift import DriftCode, charts_of, drift_of, findings_in, measured_changes
from robolink.drift.findings import mounted_trend
from robolink.drift.history import LEVEL, likeliest_split, slope_of
from robolink.errors import ConfigError
from robolink.model import EntryKind, Recorded, Signature, ToolOffset, plain_offset
from tests._rows import each_row
from tests.drift._courses import course, found, steady

# Findings in the history of a cell's tools, and what is none.

SEEDS = range(8)


def most(seed_codes):
    """Return the codes that most histories show."""
    counted = Counter(code for codes in seed_codes for code in codes)
    return {code for code, count in counted.items() if count > 4}


def after(count, **kwargs):
    return most([found(course(seed, count, **kwargs)) for seed in SEEDS])


def said_of(changes):
    return findings_in(charts_of(changes), changes)


def test_a_steady_cell_shows_nothing():
    assert after(40) == set()
    assert after(40, tools=2) == set()


def test_nozzles_that_are_measured_again_and_again_are_no_slipping_mount():
    # Within a nozzle values scatter by the touch alone: limits from them would be too tight.
    assert after(45, each_nozzle=5) == set()


def test_one_bad_change_is_unusual_and_no_slipping_mount():
    bad = lambda index, _: (0.5 * (index == 30), 0.0, 0.0)  # noqa: E731
    assert after(31, shift=bad) == {"unusual_change"}
    assert after(34, shift=bad) == set()


def test_a_mount_that_slips_shows_sideways_in_one_tool_only():
    moved = lambda index, tool: (0.1 * (index >= 25 and tool == 1), 0.0, 0.0)  # noqa: E731
    assert after(32, tools=2, shift=moved) == {"mount_shifted"}
    (finding, *_) = findings_in(charts_of(changes := course(1, 32, shift=moved)), changes)
    assert finding.subject == (1,)
    assert finding.shift_mm["x"] == pytest.approx(0.1, abs=0.04)
    assert "Tool 1 has moved sideways by X +0." in finding.sentence
    assert finding.since.startswith("2026-01-2")


def test_tools_that_shift_alike_point_at_what_they_share():
    moved = lambda index, _: (0.1 * (index >= 25), -0.08 * (index >= 25), 0.0)  # noqa: E731
    assert after(33, tools=2, shift=moved) == {"tools_shifted_alike"}


def test_opposite_shifts_are_two_mounts():
    moved = lambda index, tool: (0.1 * (index >= 25) * (-1) ** tool, 0.0, 0.0)  # noqa: E731
    assert after(33, tools=2, shift=moved) == {"mount_shifted"}


def test_a_moved_pin_is_told_from_a_moved_tool():
    assert after(30, pin=lambda index: 0.05 * (index >= 25)) == {"pin_moved"}


def test_another_length_of_nozzles_is_told():
    assert after(33, shift=lambda i, _: (0, 0, 0.1 * (i >= 25))) == {"length_shifted"}


def test_a_nozzle_that_gets_shorter_wears_and_one_that_gets_longer_moves():
    assert after(12, each_nozzle=12, wear_mm=0.005) == {"nozzle_worn"}
    assert after(12, each_nozzle=12, wear_mm=-0.005) == {"nozzle_moves"}
    assert after(12, each_nozzle=12, wear_mm=0.005, ids=False) == set(), "not known to be the same"


def test_wear_ends_with_the_next_nozzle():
    worn = course(3, 13, each_nozzle=12, wear_mm=0.01)
    assert found(worn[:12]) == {"nozzle_worn"}
    assert found(worn) == set()


def test_fewer_than_twenty_changes_draw_no_limits():
    jump = course(1, 19, shift=lambda i, _: (1.0 * (i == 18), 0, 0))
    assert all(chart.limits_mm is None for chart in charts_of(jump))
    assert found(jump) == set()
    with pytest.raises(ConfigError, match="1 values are too few"):
        charts_of(jump, baseline=1)


@each_row("seed", range(40))
def test_a_large_shift_is_said_after_four_changes_whatever_was_before(seed):
    """Earlier values that happened to lie on the same side do not belong to it."""
    slipped = course(seed, 29, shift=lambda index, _: (0.2 * (index >= 25), 0, 0))
    (said,) = (one for one in said_of(slipped) if one.code == DriftCode.MOUNT_SHIFTED)
    assert said.shift_mm["x"] == pytest.approx(0.2, abs=0.05)
    assert said.since == slipped[25].at
    moved = course(seed, 29, tools=2, pin=lambda index: 0.3 * (index >= 26))
    (said,) = (one for one in said_of(moved) if one.code == DriftCode.PIN_MOVED)
    assert said.since == moved[2 * 26].at


def test_the_limits_of_the_mean_widen_as_textbooks_say():
    """Montgomery: L sigma sqrt(lambda / (2 - lambda) (1 - (1 - lambda)^(2 i)))."""
    (chart,) = (one for one in charts_of(course(1, 26)) if one.axis == "z")
    for count, point in enumerate(chart.judged, start=1):
        share = 0.2 / 1.8 * (1 - 0.8 ** (2 * count))
        assert point.mean_reach_mm == pytest.approx(2.86 * chart.sigma_mm * share**0.5)
    assert chart.mean_limits_mm is not None
    reach = chart.judged[-1].mean_reach_mm
    assert chart.mean_limits_mm[1] - chart.centre_mm == pytest.approx(reach)


def test_a_split_counts_the_first_value_as_it_is():
    assert likeliest_split([0, 1, 0, 1, 0, 1], 1) == 2  # medians of three: 0, 0, 1, 0, 1, 1


def test_one_bad_touch_at_the_end_hides_no_slipping_mount():
    slipping = course(4, 36, shift=lambda index, _: (0.1 * (index >= 26), 0, 0))
    slipping[-1] = replace(slipping[-1], tip_mm={**slipping[-1].tip_mm, "x": 13.0})
    (said,) = (one for one in said_of(slipping) if one.code == DriftCode.MOUNT_SHIFTED)
    assert said.since == slipping[26].at


@pytest.mark.parametrize(("by_mm", "codes"), [(0.5, {"mount_shifted"}), (0.001, set())])
def test_a_cell_that_showed_the_same_digits_each_time_shifts_too(by_mm, codes):
    first = course(1, 1)[0]
    same = [replace(first, number=n, nozzle=f"N{n}") for n in range(1, 26)]
    off = {**first.tip_mm, "x": first.tip_mm["x"] + by_mm}
    assert found([*same, *(replace(one, tip_mm=off) for one in same[:4])]) == codes


def test_equal_values_have_no_limits_and_say_nothing():
    changes = course(1, 25)
    frozen = [changes[0]] * 25
    assert {chart.sigma_mm for chart in charts_of(frozen) if chart.quantity == "pin"} == {0.0}
    assert found(frozen) == set()


def test_a_turn_test_that_becomes_worse_is_told_and_one_that_becomes_better_is_not():
    for by_mm, told in ((0.06, {"turn_test_grows"}), (-0.06, set())):
        changed = [
            [
                replace(
                    change, turn_test_mm=0.1 + (change.turn_test_mm or 0.0) + by_mm * (at >= 25)
                )
                for at, change in enumerate(course(seed, 32))
            ]
            for seed in SEEDS
        ]
        assert most(found(changes) for changes in changed) == told


def entry(number, kind, tool, **details):
    return Recorded(
        number=number,
        at="2026-01-01T08:00:00.000Z",
        controller="cell",
        kind=kind,
        change="a1",
        operation="",
        tool=tool,
        tolerance="",
        verdict="",
        details=details,
        signature=Signature(),
        previous="",
        hash="",
    )


def test_a_change_that_was_taken_back_in_the_end_says_nothing_of_any_of_its_tools():
    """The first tool was kept already when the second one failed."""
    tip = plain_offset(ToolOffset(12.0, -4.0, -20.0))
    measured = [
        entry(tool, EntryKind.CALIBRATION, tool, tip=tip, measured=["x_mm", "y_mm"])
        for tool in (1, 2)
    ]
    kept = entry(3, EntryKind.DONE, 1)
    assert [one.tool for one in measured_changes([*measured, kept], lambda _: False)] == [1]
    back = entry(4, EntryKind.ROLLED_BACK, 2)
    assert measured_changes([*measured, kept, back], lambda _: False) == []


def test_what_was_measured_counts_and_not_the_difference_that_was_written():
    measured = entry(
        1,
        EntryKind.CALIBRATION,
        1,
        tip=plain_offset(ToolOffset(12.0, -4.0, -20.0)),
        proposed=plain_offset(ToolOffset(13.0, -5.0, -20.0)),
        measured=["x_mm", "y_mm"],
    )
    (change,) = measured_changes([measured, entry(2, EntryKind.DONE, 1)], lambda _: False)
    assert change.tip_mm == {"x": 12.0, "y": -4.0}


def test_the_place_of_a_pin_counts_where_the_method_finds_it():
    place = {"method": "pivot", "reference_point_mm": [300.0, 80.0, -40.0]}
    entries = [entry(1, EntryKind.CALIBRATION, 1, **place), entry(2, EntryKind.DONE, 1)]
    (change,) = measured_changes(entries, lambda method: method == "pivot")
    assert change.pin_mm == {"x": 300.0, "y": 80.0}
    (change,) = measured_changes(entries, lambda _: False)
    assert change.pin_mm is None


def test_the_course_of_one_tool_is_of_that_tool_alone():
    tip = plain_offset(ToolOffset(12.0, -4.0, -20.0))
    entries = [
        entry(number, kind, tool, tip=tip, measured=["x_mm"])
        for tool in (1, 2)
        for number, kind in enumerate((EntryKind.CALIBRATION, EntryKind.DONE), 2 * tool)
    ]
    for tool in (1, 2):
        cell = drift_of("cell", entries, finds_pin=lambda _: False, tool=tool)
        assert [one.tool for one in cell.changes] == [tool]


def test_a_slope_is_told_from_the_level_on_that_was_chosen_on_both_sides():
    """Just below the limit nothing is reported: each check is one more chance of a false alarm."""
    limit = student_t(1 - LEVEL / 2, 4)
    for share, told in ((0.97, None), (1.03, {"z"})):
        low, high = 0.0, 1.0
        for _ in range(60):  # the less scatter, the steeper
            scatter = (low + high) / 2
            values = [0.01 * at + scatter * (-1) ** (at // 2) for at in range(6)]
            low, high = (scatter, high) if slope_of(values)[1] > share * limit else (low, scatter)
        changes = [
            replace(change, nozzle="N-1", tip_mm={"z": value})
            for change, value in zip(course(1, 6), values, strict=True)
        ]
        trend = mounted_trend(changes)
        assert (trend and set(trend.moved_mm)) == told


# How often a steady cell is suspected, and how soon a change is seen; for
# docs/reference/accuracy.md 5.

RUNS, BEFORE, UNTIL = 300, 25, 55


def first_seen(name, **kwargs):
    """Return the number of histories with a code, and the median of changes before it."""
    tools = kwargs.get("tools", 1)
    seen, delays = Counter[str](), dict[str, list[int]]()
    for run in range(RUNS):
        changes, codes = course(f"{name}{run}", UNTIL, **kwargs), dict[str, int]()
        for count in range(BEFORE + 1, UNTIL + 1):
            for code in found(changes[: count * tools]):
                codes.setdefault(code, count - BEFORE)
        seen.update(codes.keys())
        for code, delay in codes.items():
            delays.setdefault(code, []).append(delay)
    shown = {code: (seen[code] / RUNS, median(delays[code])) for code in seen}
    print(f"\n{name}: share of courses, median delay in changes: {shown}")  # noqa: T201
    return shown


def moved(mm):
    return lambda index, tool: (mm * (index >= BEFORE and tool == 1), 0.0, 0.0)


@pytest.mark.soak
@pytest.mark.timeout(1200)
@pytest.mark.parametrize("each_nozzle", [1, 5])
def test_false_alarms_of_a_steady_cell(each_nozzle):
    shown = first_seen(f"steady, {each_nozzle} measurements a nozzle", each_nozzle=each_nozzle)
    assert shown.get("unusual_change", (0,))[0] < 0.15
    for code in shown.keys() - {"unusual_change"}:
        assert shown[code][0] < 0.08, code


@pytest.mark.soak
@pytest.mark.timeout(1200)
@pytest.mark.parametrize("sigmas", [1, 2, 3, 5])
def test_a_mount_that_slips(sigmas):
    shown = first_seen(f"mount slips by {sigmas} sigma", shift=moved(sigmas * 0.0206))
    if sigmas >= 3:
        assert shown["mount_shifted"][0] > 0.9


@pytest.mark.soak
@pytest.mark.timeout(1200)
@pytest.mark.parametrize("sigmas", [3, 5])
def test_a_pin_that_moves(sigmas):
    pin = lambda index: sigmas * 0.005 * (index >= BEFORE)  # noqa: E731
    shown = first_seen(f"pin moves by {sigmas} sigma", pin=pin, shift=steady)
    assert shown["pin_moved"][0] > 0.9
