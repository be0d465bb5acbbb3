"""What the journal tells of the rows of a cell, and what of it does not count."""

import math
from dataclasses import replace
from datetime import timedelta

import pytest

from robolink.accuracy import (
    CellRecord,
    LooksAlike,
    MeasuredRow,
    facts_at,
    learnt_rows,
    measured_entry,
    measured_row,
    measured_tips,
    pooled_look,
    rows_at,
    turned_pairs,
)
from robolink.calibration import RowFact
from robolink.errors import JournalError
from robolink.model import EntryKind, Recorded, Signature
from robolink.timing import wall_time

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


@pytest.mark.parametrize(
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


@pytest.mark.parametrize(
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
