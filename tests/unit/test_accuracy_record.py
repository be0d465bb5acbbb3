"""Accuracy from the record: the rows of a cell, their bounds, and how well a stored Z is known."""

import math
import random
from dataclasses import replace
from datetime import timedelta
from typing import Any

import pytest

from robolink.accuracy import (
    CellRecord,
    LooksAlike,
    MeasuredRow,
    artefact_test,
    facts_at,
    learnt_rows,
    measured_entry,
    measured_row,
    measured_tips,
    paired_half_width,
    pooled_look,
    rows_at,
    scatter_of_repeats,
    turned_pairs,
    upper_half_width,
)
from robolink.calibration import RowFact, gauge_study
from robolink.controllers import SimpleController
from robolink.errors import CalibrationError, JournalError
from robolink.methods.one_touch.solvers import find_stored_z
from robolink.model import EntryKind, NewEntry, Recorded, Signature, ToolOffset, plain_offset
from robolink.timing import wall_time
from tests._rows import each_row

# The journal's data for the rows of a cell, and the data that do not count.

ALIKE = LooksAlike("PIN-07", "n-angle")


def entry(
    entry_kind, number=1, /, *, days=0.0, change="", tool=1, station="PIN-07", nozzle="", **details
):
    at = (wall_time() - timedelta(days=days)).isoformat(timespec="milliseconds")
    return Recorded(
        number=number,
        at=at,
        controller="here",
        kind=entry_kind,
        change=change,
        operation="",
        tool=tool,
        tolerance="",
        verdict="",
        details=details,
        signature=Signature(station=station, nozzle=nozzle),
        previous="",
        hash="",
    )


def found(x_mm, y_mm, *, days=0.0, kind="pin", **details):
    said = {"station": "PIN-07", "kind": kind, "x_mm": x_mm, "y_mm": y_mm, **details}
    return replace(entry(EntryKind.STATION, days=days), details=said)


def fit(number=1, *, residual=0.01, method="n-angle", dof=4, change="", station="PIN-07", **more):
    residuals = [[residual, 0.0], [0.0, residual], [-residual, 0.0], [0.0, -residual]]
    said = {"method": method, "dof": dof, "residuals_mm": residuals, "rejected": [], **more}
    return entry(EntryKind.CALIBRATION, number, change=change, station=station, **said)


def record(*entries):
    return CellRecord(lambda *, kinds: (one for one in entries if one.kind in kinds))


def lost(*, kinds):
    raise JournalError(f"no journal for {kinds}")


def test_a_journal_that_is_lost_leaves_the_defaults():
    facts = facts_at(CellRecord(lost), station="PIN-07", stated={}, alike=ALIKE)
    assert facts.rows == {}
    assert (facts.months, facts.look_sigma_mm) == (None, None)


def test_a_place_row_grows_with_the_age_of_the_last_learning():
    old = facts_at(record(found(300, 100, days=92)), station="PIN-07", stated={}).of("place_mm")
    assert (old.half_width, old.basis) == (0.02, "default")
    assert old.growth == pytest.approx(0.0302, abs=1e-3)


def test_a_place_that_is_only_stated_is_as_old_as_the_first_calibration_there():
    facts = facts_at(record(fit(days_ := 1)), station="PIN-07", stated={}, learnt=False)
    assert facts.months == pytest.approx(0, abs=1e-3), days_
    first = entry(EntryKind.CALIBRATION, days=61, method="beams")
    elsewhere = entry(EntryKind.CALIBRATION, days=400, station="OTHER", method="beams")
    facts = facts_at(record(fit(), first, elsewhere), station="PIN-07", stated={}, learnt=False)
    assert facts.months == pytest.approx(61 / 30.44, rel=1e-3)
    assert facts.of("place_mm").growth == pytest.approx(0.02, abs=1e-3)


def test_what_is_stated_goes_before_the_record_and_what_the_record_says_more_is_known():
    places = [found(300 + 0.2 * (n % 2), 100) for n in range(6)]
    stated = {"place_mm": RowFact(0.01, "stated", told="here")}
    (row,) = rows_at(record(*places), ["place_mm"], station="PIN-07", stated=stated)
    assert (row.half_width, row.fact.basis, row.exceeded) == (0.01, "stated", True)
    assert row.on_record is not None
    assert row.on_record.half_width > 0.2


@each_row(
    "spoilt",
    [
        {"x_mm": "300", "y_mm": 100},
        {"x_mm": None, "y_mm": None},
        {"x_mm": math.nan, "y_mm": 100},
        {"x_mm": 900, "y_mm": 100, "base": [1.0, 0, 0, 0, 0, 0]},
        {"x_mm": 900, "y_mm": 100, "kind": "beams"},
        {"x_mm": 900, "y_mm": 100, "kind": "nonsense"},
    ],
)
def test_entries_that_cannot_be_compared_change_nothing(spoilt):
    places = [found(300 + 0.01 * (n % 2), 100) for n in range(6)]
    right = learnt_rows(places, "PIN-07")["place_mm"]
    odd = found(**{"x_mm": 0, "y_mm": 0, **spoilt})
    told = learnt_rows([*places[:3], odd, *places[3:]], "PIN-07")["place_mm"]
    assert told.half_width == pytest.approx(right.half_width)


def test_a_station_that_was_moved_on_purpose_is_learnt_anew_and_not_scattered():
    places = [found(300 + 0.01 * (n % 2) + (50 if n > 5 else 0), 100) for n in range(12)]
    assert learnt_rows(places, "PIN-07")["place_mm"].half_width < 0.03


def camera(turn_deg, scale, *, x_mm=170.0):
    a, b = scale * math.cos(math.radians(turn_deg)), scale * math.sin(math.radians(turn_deg))
    rows = [[a, b], [b, -a]]
    origin = [x_mm - a * 320 - b * 240, 477.0 - b * 320 + a * 240]
    details = {"mm_per_px": rows, "origin_mm": origin, "centre_mm": [x_mm, 477.0]}
    return found(x_mm, 477.0, kind="camera", **details)


def test_a_camera_found_again_and_again_tells_turn_scale_and_place():
    seen = [camera(179.95 + 0.1 * (n % 2), 0.02 * (1 + 0.002 * (n % 2))) for n in range(7)]
    rows = learnt_rows(seen, "PIN-07")
    assert 0.1 < rows["camera_turn_deg"].half_width < 0.4
    assert 0.2 < rows["camera_scale_percent"].half_width < 0.8
    assert rows["place_mm"].half_width < 0.005
    assert "camera_turn_deg" not in learnt_rows(seen[:4], "PIN-07")


def test_looks_that_were_made_alike_are_pooled():
    pooled = pooled_look([fit(n) for n in range(3)], ALIKE)
    assert pooled == pytest.approx((0.01, 12))


def test_what_was_not_made_alike_is_not_pooled():
    others = [
        fit(residual=1, station="OTHER"),
        fit(residual=1, method="pivot"),
        fit(residual=1, change="now"),
        fit(residual=1, touches=[{"contact": True}]),
        fit(residual=1, dof="4"),
        fit(residual=math.inf),
        fit(residual=1, dof=0),
    ]
    alike = LooksAlike("PIN-07", "n-angle", change="now")
    assert pooled_look([*others, *(fit(n) for n in range(3))], alike) == pooled_look(
        [fit(n) for n in range(3)], ALIKE
    )
    assert pooled_look(others, alike) is None
    assert pooled_look([fit()], ALIKE) is None
    assert pooled_look([fit(n) for n in range(9)], LooksAlike("", "n-angle")) is None


def test_past_calibrations_are_read_where_a_station_can_use_them_and_not_else():
    kept = [fit(n) for n in range(9)]
    asked = []

    def recall(*, kinds):
        asked.extend(kinds)
        return iter(kept if kinds == (EntryKind.CALIBRATION,) else ())

    nowhere = facts_at(
        CellRecord(recall), station="", stated={}, alike=LooksAlike("", "n-angle"), learnt=False
    )
    assert nowhere.look_sigma_mm is None
    assert EntryKind.CALIBRATION not in asked
    there = facts_at(CellRecord(recall), station="PIN-07", stated={}, alike=ALIKE, learnt=False)
    assert there.look_sigma_mm == pytest.approx(0.01)
    assert EntryKind.CALIBRATION in asked


def row_entry(for_station="", half_width=0.03, spoilt=()):
    found = MeasuredRow(
        row="touch_mm", half_width=half_width, by="artefact-test", station=for_station
    )
    said = {**measured_entry(found).details, **dict(spoilt)}
    made = entry(EntryKind.ACCURACY, 9)
    return replace(made, details=said)


def test_the_newest_row_counts_and_that_of_the_station_before_that_of_the_cell():
    entries = [row_entry(half_width=0.03), row_entry("PIN-07", 0.02), row_entry("PIN-07", 0.5)]
    here = facts_at(record(*entries), station="PIN-07", stated={}).of("touch_mm")
    assert (here.half_width, here.basis) == (0.02, "record")
    assert "entry 9" in here.told
    assert facts_at(record(*entries), station="PIN-08", stated={}).of("touch_mm").half_width == 0.03


@each_row(
    "more",
    [
        {"half_width": 0},
        {"half_width": -1.0},
        {"half_width": math.nan},
        {"half_width": "0.01"},
        {"half_width": True},
        {"row": "nothing_mm"},
        {"unit": "m"},
        {"by": "guess"},
    ],
)
def test_a_row_that_cannot_be_read_does_not_count(more):
    assert measured_row(row_entry(spoilt=more)) is None
    assert facts_at(record(row_entry(spoilt=more)), station="", stated={}).of("touch_mm").basis == (
        "default"
    )


def seen(number, nozzle, x_mm, *, method="camera", **more):
    said = {"method": method, "measured": ["x_mm", "y_mm"], "tip": [x_mm, 0, 0, 0, 0, 0], **more}
    return entry(EntryKind.CALIBRATION, number, nozzle=nozzle, **said)


def test_tips_for_a_study_are_those_that_somebody_saw():
    touched = [{"contact": True}]
    odd = [
        seen(1, "", 1, method="beams"),
        seen(2, "", 1, method="one-touch"),
        seen(3, "", 1, method="two-pose", touches=touched),
        seen(4, "", 1, method="gone"),
        seen(5, "", math.nan),
        seen(6, "", 1, measured=["z_mm"]),
        entry(EntryKind.CALIBRATION, 7),
    ]
    right = [seen(8, "", 1, method="two-pose"), seen(9, "", 1)]
    assert [tip.number for tip in measured_tips([*odd, *right])] == [8, 9]


def test_pairs_are_the_last_two_of_each_nozzle():
    tips = measured_tips([seen(1, "A", 9), seen(4, "A", 1), seen(3, "B", 1), seen(6, "A", 2)])
    ((first, last),) = turned_pairs(tips)
    assert (first.number, last.number) == (4, 6)


# Rows from records: too large in 95 %, whatever the scatter, and never 0.

RUNS = 400


def scatter(values, **options):
    bound = scatter_of_repeats(values, **{"anew_from": 0.5, **options})
    assert bound is not None
    return bound


def upper(values):
    bound_mm = gauge_study(values).reproducibility_upper95_mm
    assert bound_mm is not None
    return bound_mm


def share(holds):
    return sum(holds) / len(holds)


@pytest.mark.parametrize("count", [5, 20])
def test_repeated_learning_bounds_its_scatter_in_95_percent(count):
    rng = random.Random(count)
    held = []
    for _ in range(RUNS):
        places = [(rng.gauss(0, 0.01), rng.gauss(0, 0.01)) for _ in range(count)]
        bound = scatter(places)
        held.append(bound.half_width >= 0.01 * math.sqrt(3))
    assert 0.91 < share(held) < 0.99


def test_a_step_on_purpose_is_no_scatter_and_a_bump_is():
    steady = [(0.001 * (n % 2), 0.0) for n in range(6)]
    anew = [(5 + 0.001 * (n % 2), 0.0) for n in range(6)]
    without = scatter(steady)
    assert scatter(steady + anew).half_width < without.half_width
    bumped = steady + [(x + 0.3, y) for x, y in steady]
    assert scatter(bumped).half_width > 0.1


def test_four_records_or_four_that_follow_each_other_tell_nothing():
    assert scatter_of_repeats([(0.0,)] * 4, anew_from=0.5) is None
    apart = [(float(n),) for n in range(20)]
    assert scatter_of_repeats(apart, anew_from=0.5) is None


def test_what_never_scatters_has_the_last_digit_left():
    bound = scatter([(1.0, 2.0)] * 9, floor=0.0003)
    assert bound.half_width > 0.0003


@each_row("toward_deg", [0, 30, 135])
def test_the_region_of_an_artefact_test_holds_the_bias_in_any_direction(toward_deg):
    rng, bias, held = random.Random(toward_deg), 0.05, []
    dx, dy = (bias * f(math.radians(toward_deg)) for f in (math.cos, math.sin))
    for _ in range(RUNS):
        seen = [(12 + dx + rng.gauss(0, 0.02), -4 + dy + rng.gauss(0, 0.02)) for _ in range(5)]
        half_width = artefact_test(seen, (12, -4)).half_width_mm
        held.append(2.4477 * half_width / math.sqrt(3) >= bias)
    assert share(held) > 0.97


def test_what_is_not_known_of_the_gauge_tip_is_in_the_row():
    seen = [(12.0, -4.0)] * 5
    assert artefact_test(seen, (12.0, -4.0), known_u_mm=0.01).half_width_mm == pytest.approx(
        0.01 * math.sqrt(3)
    )


@each_row("count", [0, 1, 4])
def test_fewer_than_five_are_refused(count):
    seen = [(1.0, 2.0)] * count
    for refused in (
        lambda: artefact_test(seen, (1.0, 2.0)),
        lambda: paired_half_width(seen, seen),
    ):
        with pytest.raises(CalibrationError) as error:
            refused()
        assert error.value.code == "too_few_records"


def test_persons_who_do_not_differ_have_a_bound_that_is_not_0():
    rng = random.Random(1)
    values = [[[n + rng.gauss(0, 0.01) for _ in range(3)] for _ in range(3)] for n in range(10)]
    assert upper(values) > gauge_study(values).reproducibility_mm
    assert upper(values) > 0.001


def test_the_bound_of_a_study_holds_what_persons_differ_by():
    rng, held = random.Random(2), []
    for _ in range(RUNS):
        persons = [rng.gauss(0, 0.02) for _ in range(3)]
        values = [[[n + p + rng.gauss(0, 0.01) for _ in (1, 2)] for p in persons] for n in range(5)]
        held.append(upper(values) >= 0.02)
    assert share(held) > 0.92


def test_more_records_cost_less():
    assert upper_half_width(0.01, 4) > upper_half_width(0.01, 20) > 0.01 * math.sqrt(3)


# Whether the record shows how well a stored Z is known: only a measurement of it does.

OLD = ToolOffset(12.0, -4.0, -20.0)
MEASURED = replace(OLD, z_mm=-20.4)


@pytest.fixture
def log(request):
    with SimpleController(identity=request.node.name) as controller:
        yield Log(controller)


class Log:
    """Records calibrations and writes, the oldest first."""

    def __init__(self, controller):
        self.controller, self._count = controller, 0

    def calibrated(self, before, value, *, measured, z_from, half=0.02, tip=None, **more: Any):
        self._count += 1
        change = f"c{self._count}"
        of_measurement = more.pop("of_measurement", {})
        self.controller.outcomes.append(
            NewEntry(
                EntryKind.CALIBRATION, change=change, tool=1,
                details={"measured": measured, "half_width95": [half] * len(measured)}
                | of_measurement,
            ),
            NewEntry(
                EntryKind.DONE, change=change, tool=1,
                details={"before": plain_offset(before), "value": plain_offset(value),
                         "tip": plain_offset(tip or value), "method": "m", "z_from": z_from}
                | more,
            ),
        )  # fmt: skip

    def typed(self, before, value):
        details = {"before": plain_offset(before), "value": plain_offset(value)}
        self.controller.outcomes.append(NewEntry(EntryKind.DONE, tool=1, details=details))

    def half_of(self, value):
        return find_stored_z(self.controller, 1, value).half95_mm


Z = ["z_mm"]
XY = ["x_mm", "y_mm"]
ASIDE = replace(MEASURED, x_mm=12.3)


def test_z_that_was_measured_has_the_interval_of_then(log):
    assert log.half_of(MEASURED) is None
    log.calibrated(OLD, MEASURED, measured=Z, z_from="measured")
    assert log.half_of(MEASURED) == 0.02
    # Another value has nothing to do with it.
    assert log.half_of(OLD) is None


@pytest.mark.parametrize(
    ("more", "half"),
    [
        ({"z_from": "kept"}, None),  # of another needle, as far as is known
        ({"z_from": "kept", "nozzle": "N-1"}, 0.02),  # the same needle
        ({"z_from": "kept", "nozzle": "N-2"}, None),
        ({"z_from": "measured", "length_checked": {"u_mm": 0.01}}, (0.02**2 + 0.0196**2) ** 0.5),
    ],
)
def test_z_that_was_kept_is_known_where_the_needle_or_the_heights_are_the_same(log, more, half):
    log.calibrated(OLD, MEASURED, measured=Z, z_from="measured", nozzle="N-1")
    log.calibrated(MEASURED, ASIDE, measured=XY, **more)
    assert log.half_of(ASIDE) == (None if half is None else pytest.approx(half, rel=1e-3))


@pytest.mark.parametrize("aside_mm", [-0.3, 0.3])
def test_a_z_that_was_kept_has_to_be_the_one_that_was_measured(log, aside_mm):
    log.calibrated(OLD, MEASURED, measured=Z, z_from="measured", nozzle="N-1")
    shifted = replace(ASIDE, z_mm=MEASURED.z_mm + aside_mm)
    log.calibrated(shifted, shifted, measured=XY, z_from="kept", nozzle="N-1")
    assert log.half_of(shifted) is None


def test_x_and_y_that_were_typed_leave_z_as_known_as_it_was(log):
    log.calibrated(OLD, MEASURED, measured=Z, z_from="measured")
    log.typed(MEASURED, ASIDE)
    assert log.half_of(ASIDE) == 0.02


def test_a_z_that_was_typed_or_is_no_tip_is_not_known(log):
    log.calibrated(OLD, MEASURED, measured=Z, z_from="measured")
    other = replace(MEASURED, z_mm=-21.0)
    log.typed(MEASURED, other)
    assert log.half_of(other) is None
    # A value by difference lies beside the found tip.
    log.calibrated(other, OLD, measured=Z, z_from="measured", tip=MEASURED)
    assert log.half_of(OLD) is None
    # Without an interval there is none to use.
    log.calibrated(
        OLD, MEASURED, measured=Z, z_from="measured", of_measurement={"half_width95": []}
    )
    assert log.half_of(MEASURED) is None


def test_changes_by_one_touch_go_back_to_where_they_began(log):
    log.calibrated(OLD, MEASURED, measured=Z, z_from="measured")
    stored = {"value_mm": -20.4, "half95_mm": 0.02, "entry": 1}
    longer = replace(MEASURED, z_mm=-20.6)
    log.calibrated(
        MEASURED, longer, measured=[*XY, *Z], z_from="measured", half=0.05,
        of_measurement={"stored_z": stored},
    )  # fmt: skip
    found = find_stored_z(log.controller, 1, longer)
    assert (found.half95_mm, found.entry) == (0.02, 1)
    # One whose Z was never measured shows nothing, whatever follows.
    again = replace(longer, z_mm=-20.5)
    log.calibrated(
        longer, again, measured=XY, z_from="kept",
        of_measurement={"changed": ["z_mm"], "stored_z": stored | {"half95_mm": None}},
    )  # fmt: skip
    assert log.half_of(again) is None
