"""Which tilts an arm can take up over the pin, and which others instead of the rest."""

from collections.abc import Iterator, Sequence
from typing import Final

from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.methods.pivot.tilts import (
    UPRIGHT,
    OverPin,
    Tilt,
    best_tilts,
    proving_pairs,
    tilt_path,
    tilts_around,
)
from robolink.model import Path
from robolink.runner import Consider, Move, Notify, Procedure
from robolink.ways import Way, way

LEAST_TILTS: Final = 3
"""With the first touch that makes four, the fewest that a pivot is measured with."""


def tilts_in_reach(
    over: OverPin, wanted: Sequence[Tilt], lift_mm: float
) -> Procedure[tuple[Tilt, ...]]:
    """Return the wanted orientations, or those that tell the most of what the arm can take up.

    Where the pin is shows at the first touch, and with it which orientations are in reach: inside
    the limits, and away from a singular wrist. Others lean as far, or half as far.

    Args:
        over: The pin as the first touch showed it.
        wanted: The orientations of the plan.
        lift_mm: How far above the pin the tool tilts.

    Raises:
        CalibrationError: ``not_tilted``: fewer than three are left; nothing was tilted.
    """
    refusals = yield from _refusals(over, wanted, lift_mm)
    if not any(refusals):
        return tuple(wanted)
    first = next(filter(None, refusals))
    tilt_deg = max(abs(tilt.lean_deg) for tilt in wanted)
    choice = [*tilts_around(tilt_deg), *tilts_around(tilt_deg / 2)]
    found = yield from _refusals(over, choice, lift_mm)
    free = [tilt for tilt, refusal in zip(choice, found, strict=True) if not refusal]
    if len(free) < LEAST_TILTS:
        raise _not_tilted(first)
    chosen = best_tilts(free, min(len(wanted), len(free)))
    yield Notify(
        tr(
            "{missed} of the {count} planned tilts cannot be reached over this pin: "
            "{why} Others replace them, {chosen} in all.",
            missed=sum(map(bool, refusals)),
            count=len(wanted),
            why=first,
            chosen=len(chosen),
        )
    )
    return chosen


def free_tilts(
    over: OverPin, choice: Sequence[Tilt], lift_mm: float
) -> Procedure[tuple[Tilt, ...]]:
    """Return which of many orientations the arm can take up over a place, in their order.

    Args:
        over: The place as the first touch showed it.
        choice: What there is to choose from.
        lift_mm: How far above it the tool tilts.

    Raises:
        CalibrationError: ``not_tilted``: fewer than three are left; nothing was tilted.
    """
    refusals = yield from _refusals(over, choice, lift_mm)
    free = tuple(tilt for tilt, refusal in zip(choice, refusals, strict=True) if not refusal)
    if len(free) < LEAST_TILTS:
        raise _not_tilted(next(filter(None, refusals)))
    if len(free) < len(choice):
        yield Notify(
            tr(
                "{missed} of {count} tilts cannot be reached here: {why} The touches "
                "are chosen from the others.",
                missed=len(choice) - len(free),
                count=len(choice),
                why=next(filter(None, refusals)),
            )
        )
    return free


def proving_in_reach(
    over: OverPin, wanted: Sequence[Tilt], lift_mm: float
) -> Procedure[tuple[Tilt, ...]]:
    """Return the orientations of a proof, or the first pair half a turn apart that can be taken up.

    Args:
        over: The pin, and the tip as it was measured.
        wanted: The orientations of the plan.
        lift_mm: How far above the pin the tool tilts.

    Raises:
        CalibrationError: ``not_tilted``: there is no such pair, so nothing is proved.
    """
    refusals = yield from _refusals(over, wanted, lift_mm)
    if not any(refusals):
        return tuple(wanted)
    for pair in proving_pairs(max(abs(tilt.lean_deg) for tilt in wanted)):
        if not any((yield from _refusals(over, pair, lift_mm))):
            return pair
    raise _not_tilted(next(filter(None, refusals)))


def _refusals(over: OverPin, tilts: Sequence[Tilt], lift_mm: float) -> Procedure[list[str]]:
    """Return for each orientation why the arm cannot go there and touch, empty where it can."""
    ways = [tuple(_way(over, tilt, lift_mm)) for tilt in tilts]
    told: tuple[str, ...] = yield Consider(tuple(move for moves in ways for move in moves))
    left = iter(told)
    return [next(filter(None, [next(left) for _ in moves]), "") for moves in ways]


def _way(over: OverPin, tilt: Tilt, lift_mm: float) -> Iterator[Move]:
    """Yield the movements that lead to a touch: tilting in the air, down to the pin, up again."""
    for between in tilt_path(UPRIGHT, tilt):
        yield Move(over.pose(between, lift_mm), Path.JOINT, "")
    for above_mm in (0.0, lift_mm):
        yield Move(over.pose(tilt, above_mm), Path.STRAIGHT, "")


def _not_tilted(why: str) -> CalibrationError:
    return CalibrationError(
        "not_tilted",
        tr("Too few orientations can be reached over this pin: {why}", why=why),
        remedy=tr(
            "Nothing was tilted. Put the pin where the arm has room to all sides, tilt less with "
            "{tilt}, or teach the poses and give {points}.",
            tilt=way(Way.TILT),
            points=way(Way.TAUGHT_POINTS),
        ),
    )
