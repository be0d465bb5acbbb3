"""What a camera learns: exposure, and from a known movement how late its pictures are."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import pytest

from robolink.errors import CalibrationError
from robolink.eye.candidate import Candidate, CandidateRefusal, RefusalCode
from robolink.eye.picture import CameraPicture
from robolink.eye.teaching import LagSeen, MovedSpot, PictureLag, exposed_well, lag_after

BEFORE = Candidate(100.0, 80.0, 20.0, 0.9)
PICTURE_S = 0.1


def at(x_px: float, y_px: float = 80.0) -> Candidate:
    return Candidate(x_px, y_px, 20.0, 0.9)


@dataclass
class Bench:
    """Pictures of a tip that stands at 150 px since ``stopped``; a picture takes a tenth of a s."""

    late_s: float = 0.0
    late_pictures: int = 0
    stays: bool = False
    mid: Sequence[float] = ()
    lost: bool = False
    ns: int = 0
    taken: int = 0
    passed: list[float] = field(default_factory=list)

    def now_ns(self) -> int:
        return self.ns

    def sleep(self, seconds: float) -> None:
        self.ns += round(seconds * 1e9)

    def look(self) -> Sequence[Candidate]:
        asked_s = self.ns / 1e9
        self.ns += round(PICTURE_S * 1e9)
        number, self.taken = self.taken, self.taken + 1
        if self.lost:
            return ()
        old = asked_s < self.late_s or number < self.late_pictures
        if self.stays or old:
            return (BEFORE,)
        index = number - self.late_pictures
        return (at(self.mid[index] if index < len(self.mid) else 150.0),)

    def lag(self) -> LagSeen:
        return lag_after(self.look, BEFORE, clock=self, stopped_ns=0, patience_s=5.0)


def test_pictures_that_are_fresh_have_no_lag():
    lag = Bench().lag()
    assert (lag.lag_s, lag.pictures, lag.spot.x_px) == (0.0, 0, 150.0)


def test_pictures_that_are_late_in_time_show_it():
    lag = Bench(late_s=0.45).lag()
    assert lag.lag_s == pytest.approx(0.5)
    assert lag.pictures == 5


def test_a_picture_of_the_movement_itself_does_not_count_as_fresh():
    """Where the arm still swings, the second of two alike pictures settles it."""
    lag = Bench(mid=(120.0, 140.0, 148.0)).lag()
    assert lag.pictures == 3
    assert lag.spot.x_px == 150.0


def test_what_stays_where_it_was_is_no_tip():
    with pytest.raises(CalibrationError) as refused:
        Bench(stays=True).lag()
    assert refused.value.code == "tip_did_not_move"


def test_a_fleck_found_again_a_pixel_aside_is_no_tip():
    bench = Bench(mid=[102.0] * 100)
    with pytest.raises(CalibrationError) as refused:
        bench.lag()
    assert refused.value.code == "tip_did_not_move"


def test_a_tip_that_leaves_the_picture_is_told_as_such():
    with pytest.raises(CalibrationError) as refused:
        Bench(lost=True).lag()
    assert refused.value.code == "tip_not_seen"


def test_two_tips_after_the_movement_are_no_answer():
    bench = Bench()
    both = (at(150.0), at(250.0))
    with pytest.raises(CalibrationError):
        lag_after(lambda: bench.look() and both, BEFORE, clock=bench, stopped_ns=0, patience_s=1.0)


def test_refused_candidates_do_not_count():
    refused = Candidate(
        150.0, 80.0, 20.0, 0.9, refused=(CandidateRefusal(RefusalCode.NO_BORE, 0.1, 0.5),)
    )
    bench = Bench()
    with pytest.raises(CalibrationError):
        lag_after(
            lambda: bench.look() and (refused,), BEFORE, clock=bench, stopped_ns=0, patience_s=1.0
        )


def test_the_search_for_a_fresh_picture_ends_where_time_stands_still():
    class Still(Bench):
        def look(self):
            self.taken += 1
            return (BEFORE,)

    bench = Still()
    with pytest.raises(CalibrationError):
        bench.lag()
    assert bench.taken == 200


@pytest.mark.parametrize(
    ("late", "expected"),
    [
        ({}, (0.0, 0)),
        ({"late_s": 0.45}, (0.55, 0)),
        ({"late_pictures": 3}, (0.0, 3)),
        ({"late_s": 0.45, "late_pictures": 2}, (0.55, 2)),
    ],
    ids=["fresh", "by time", "by number", "by both"],
)
def test_two_movements_tell_time_from_number(late, expected):
    at_once = Bench(**late).lag()
    waited = Bench(**late)
    waited.sleep(at_once.lag_s + 0.05)
    lag = PictureLag.of(at_once, waited.lag())
    assert lag.seconds == pytest.approx(expected[0])
    assert lag.pictures == expected[1]


def moved(there: Candidate, back: Candidate = BEFORE) -> MovedSpot:
    return MovedSpot(BEFORE, there, back, math.hypot(1.0, 1.0))


def test_a_movement_shows_the_length_of_a_pixel_and_the_width_of_the_tip():
    spot = moved(at(150.0, 130.0))
    assert spot.mm_per_px == pytest.approx(0.02)
    assert spot.diameter_mm == pytest.approx(0.8)
    spot.require_consistent(0.8)
    spot.require_consistent(None)


@pytest.mark.parametrize(
    ("there", "back", "stated", "code"),
    [
        (at(150.0, 130.0), at(112.0), None, "tip_did_not_move"),
        (at(150.0, 130.0), BEFORE, 1.3, "spot_changed"),
        (at(150.0, 130.0), BEFORE, 0.5, "spot_changed"),
    ],
    ids=["did not come back", "an inner edge", "an outer edge"],
)
def test_what_cannot_be_the_tip_is_not_taught(there, back, stated, code):
    with pytest.raises(CalibrationError) as refused:
        moved(there, back).require_consistent(stated)
    assert refused.value.code == code


@dataclass
class Lamp:
    """A camera whose picture is as bright as its exposure is long, up to its longest one."""

    exposure_us: float | None
    level_per_us: float = 0.02
    longest_us: float = 100_000.0
    taken: int = 0

    identity = "a camera"

    def expose(self, exposure_us: float) -> None:
        if self.exposure_us is not None:
            self.exposure_us = min(exposure_us, self.longest_us)

    def take(self) -> CameraPicture:
        self.taken += 1
        level = 90.0 if self.exposure_us is None else self.level_per_us * self.exposure_us
        return CameraPicture(np.full((20, 20), min(round(level), 255), np.uint8), asked_s=0.0)

    def close(self) -> None: ...


@pytest.mark.parametrize("begins_us", [500.0, 10_000.0, 80_000.0])
def test_the_exposure_is_set_so_that_nothing_is_white(begins_us):
    lamp = Lamp(begins_us)
    picture = exposed_well(lamp)
    assert 160 <= int(picture.grey.max()) <= 240
    assert lamp.taken <= 6


def test_a_camera_without_exposure_keeps_its_picture():
    lamp = Lamp(None)
    assert int(exposed_well(lamp).grey.max()) == 90
    assert lamp.taken == 1


def test_an_exposure_at_its_end_is_not_asked_for_again():
    lamp = Lamp(90_000.0, level_per_us=0.0005, longest_us=90_000.0)
    assert int(exposed_well(lamp).grey.max()) == 45
    assert lamp.taken == 1
