"""Populations of nozzle changes: the error in each, and its draw.

Population, course and number decide a run, so any of them can be run alone.
"""

import cmath
import math
import random
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

from robolink.calibration import ACCURACY_ROWS, TurnClaim
from tests.certificate.live import COURSES, Course, Ended, change, slips, wrong_by
from tests.contract._camera_cell import furnish

CLEAN: Final = "clean"
IN_ROW: Final = "up to one row"
BEYOND: Final = "one to two rows"
VISIBLE: Final = "visible to the turn test"
NEAR: Final = "near the limit of the turn test"
POPULATIONS: Final = (CLEAN, IN_ROW, BEYOND, VISIBLE, NEAR)
"""The last one has only the goal that nothing is far outside: an error that a turn test lets pass
must be small against the stated accuracy.
"""

_PLANE: Final = ("touch_mm", "place_mm", "tip_image_px")
"""Rows of a vector in the plane; each coordinate lies anywhere within the half width."""

_COSTLY: Final[Mapping[str, float]] = {
    "beams on PLC": 0.5,
    "beams once on PLC": 0.5,
    "beams --turn on PLC": 0.4,
    "z-touch on PLC": 0.5,
    "z-touch, quick on PLC": 0.5,
    "plane-touch on PLC": 0.5,
    "sphere-touch on PLC": 0.5,
    "six-point on PLC": 0.7,
}
"""Share of the other methods' runs: these take most of the time."""

UNREACHABLE: Final = ("402",)
"""The arm cannot turn about the pin at its place: another cell is drawn."""

ANOTHER: Final = 1_000_000

FACTORS: Final[Mapping[str, tuple[float, float]]] = {VISIBLE: (1.5, 6.0), NEAR: (0.4, 1.5)}
"""A visible fault makes a drift of so many times the claim's limit for scatter alone: at 3.7
standard deviations half of the drifts of that size exceed the limit, at 1.5 times the limit 97 %.
"""


@dataclass(frozen=True)
class Run:
    """One change of a population.

    Attributes:
        population: Its population.
        course: Its method and cell.
        seed: The seed of everything in it.
        fault: The fault, in words.
        ended: Its end.
    """

    population: str
    course: Course
    seed: int
    fault: str
    ended: Ended


def shares(total: int, population: str) -> Iterator[tuple[Course, int]]:
    """Yield the number of runs of each course in a population."""
    courses = [one for one in COURSES if _belongs(one, population)]
    weights = [_COSTLY.get(one.name, 1.0) for one in courses]
    given, due = 0, 0.0
    for course, weight in zip(courses, weights, strict=True):
        due += total * weight / sum(weights)
        yield course, round(due) - given
        given = round(due)


def _belongs(course: Course, population: str) -> bool:
    """Return whether a course suits a population: has a turn test, or a row to be wrong in."""
    if population in FACTORS:
        return course.proves
    return population == CLEAN or bool(course.rows)


def run_one(population: str, course: Course, seed: int) -> Run:
    """Make one change of a population."""
    found = _run_one(population, course, seed)
    while found.ended.code in UNREACHABLE:
        found = _run_one(population, course, found.seed + ANOTHER)
    return found


def _run_one(population: str, course: Course, seed: int) -> Run:
    rng = random.Random(f"{population} {course.name} {seed}")
    if population in FACTORS:
        return _moving(population, course, seed, rng)
    rows = {} if population == CLEAN else _drawn(course, rng, beyond=population == BEYOND)
    told = ", ".join(f"{key} {_in_words(by)}" for key, by in rows.items())
    return Run(population, course, seed, told, change(course, seed, wrong=_wrong(rows)))


def _in_words(by: Sequence[float]) -> str:
    return "/".join(f"{value:.3f}" for value in by)


def _wrong(rows: Mapping[str, tuple[float, ...]]) -> Callable[[Any], None]:
    def put_in(cell: Any) -> None:
        for key, by in rows.items():
            if key == "print_mm":
                count = len(cell.simulator.world.board.drawing_mm)
                wrong_by({key: by[: 2 * count]})(cell)
            else:
                wrong_by({key: by})(cell)

    return put_in


def _drawn(course: Course, rng: random.Random, *, beyond: bool) -> dict[str, tuple[float, ...]]:
    """Return a cell's random error in each row of a course, within the row.

    Beyond: one of the rows is exceeded by up to its half width.
    """
    exceeded = rng.choice(course.rows) if beyond else ""
    found = {}
    for key in course.rows:
        half, count = ACCURACY_ROWS[key].default, 2 if key in _PLANE else 1
        if key == "print_mm":
            count = 8
        by = _anywhere(rng, half, count, beyond=key == exceeded)
        found[key] = (abs(by[0]), rng.uniform(0.0, 360.0)) if key == "bend_deg" else by
    return found


def _anywhere(rng: random.Random, half: float, count: int, *, beyond: bool) -> tuple[float, ...]:
    while True:
        wide = 2 * half if beyond else half
        by = tuple(rng.uniform(-wide, wide) for _ in range(count))
        if not beyond or max(map(abs, by)) > half:
            return by


# Faults that a turn test can see.


_MOVES: Final = ("beams", "beams once", "camera, one look", "one-touch")
"""Methods that rely on the place of a station, so that a moved one turns into drift."""

_LENGTHS: Final = ("z-touch", "z-touch, quick")
"""Methods that tell Z alone."""

_BUMPS: Final = ("two-pose", "n-angle", "n-angle, contact input")


def _moving(population: str, course: Course, seed: int, rng: random.Random) -> Run:
    """Make a change with a movement, by the amount that the claim of the same cell lets pass."""
    right = change(course, seed)
    proposal, proof = right.proposal, right.proof
    if right.code or proposal is None or proposal.claim is None or proof is None:
        return Run(population, course, seed, "refused without a fault", right)
    assert proof.judgement is not None
    claim = proposal.claim
    limits = [one.repeatable_mm for one in proof.judgement.limits]
    turned = [drift.u_deg for drift in proof.drifts]
    least, most = FACTORS[population]
    factor = least * (most / least) ** rng.random()
    toward = cmath.exp(1j * rng.uniform(0.0, math.tau))
    kinds = ["slip"]
    if course.method in _MOVES:
        kinds.append("station moved")
    if course.method in _BUMPS:
        kinds.append("pin bumped")
    kind = rng.choice(kinds)
    wrong: Callable[[Any], None] = _nothing
    at_write: Callable[[Any], None] = _nothing
    if kind == "slip":
        size_mm = factor * min(limits)
        by = size_mm * toward
        if course.method in _LENGTHS:
            at_write = slips(0.0, 0.0, math.copysign(size_mm, toward.real))
        else:
            at_write = slips(by.real, by.imag)
    elif kind == "station moved":
        size_mm = factor * _of_unit(limits, [abs(z) for z in _shown_of_place(claim, turned)])
        by = size_mm * toward
        wrong = wrong_by({"place_mm": (by.real, by.imag)})
    else:
        after = rng.randrange(1, len(claim.headings_deg) + 1)
        size_mm = factor * _of_unit(limits, _shown_of_bump(claim, turned, after))
        wrong = partial(
            furnish,
            pin_bumped_after_touch=after,
            pin_bump_mm=size_mm,
            pin_bump_toward_deg=math.degrees(cmath.phase(toward)) % 360.0,
        )
        kind = f"pin bumped after touch {after}"
    ended = change(course, seed, wrong=wrong, at_write=at_write)
    return Run(population, course, seed, f"{kind} by {size_mm:.3f}, {factor:.1f} limits", ended)


def _nothing(_cell: Any) -> None:
    pass


def _of_unit(limits: Sequence[float], shown: Sequence[float]) -> float:
    """Return the size of a fault that brings its most visible drift to its limit."""
    return min(limit / max(share, 1e-3) for limit, share in zip(limits, shown, strict=True))


def _shown_of_place(claim: TurnClaim, turned_deg: Sequence[float]) -> list[complex]:
    """Return the visible part of drifts for a place that all looks had wrong."""
    looks = [cmath.exp(1j * math.radians(one)) for one in claim.headings_deg]
    mean = sum(1 / look for look in looks) / len(looks)
    return [1 - cmath.exp(1j * math.radians(one)) * mean for one in turned_deg]


def _shown_of_bump(claim: TurnClaim, turned_deg: Sequence[float], after: int) -> list[float]:
    """Return the visible part of drifts for a pin bumped by 1 mm after a touch.

    The touches before it fit the pin's old place, those after it the new one: f = p - z t.
    """
    import numpy as np

    z = np.exp(1j * np.radians(claim.headings_deg))
    f = np.array([0.0 if number < after else 1.0 for number in range(len(z))], dtype=complex)
    (tip, pin), *_ = np.linalg.lstsq(np.stack([-z, np.ones_like(z)], axis=1), f, rcond=None)
    tests = np.exp(1j * np.radians(turned_deg))
    return [abs(complex(1.0 + one * tip - pin)) for one in tests]
