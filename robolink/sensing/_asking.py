"""Several pictures, and the one place that they agree on."""

import math
from collections.abc import Sequence
from itertools import combinations
from statistics import median
from typing import Final

from robolink.errors import CalibrationError, OutcomeUnknownError, StoppedError
from robolink.messages import tr
from robolink.model import TIP, Spot, TipSensor

_QUARTER_OF_DIFFERENCES: Final = 0.4506
"""Lower quartile of |a - b| for two normal numbers of standard deviation 1: 0.3186 sqrt(2)."""


def seen_once(sensor: TipSensor, mark: int, *, pictures: int) -> Spot:
    """Return where a camera sees a mark: the median of some pictures, in its own unit.

    The median, because one false detection among three pictures does not shift it far.

    Args:
        sensor: The camera.
        mark: What is looked for: ``TIP``, or the number of a fiducial.
        pictures: How many are taken.

    Raises:
        CalibrationError: ``tip_not_seen`` or ``fiducial_not_seen``: not in most of the pictures;
            ``several_tips_seen`` or ``several_fiducials_seen``: more than one at a time;
            ``non_finite``: the camera answers with something that is no place;
            ``sensor_failed``: it does not answer.

    Example:
        >>> from types import SimpleNamespace
        >>> from robolink import Spot
        >>> from robolink.model import TIP
        >>> from robolink.sensing import seen_once
        >>> answers = iter([Spot(312.3, 96.3), Spot(312.4, 96.3), Spot(340.0, 96.3)])
        >>> camera = SimpleNamespace(see=lambda mark: [next(answers)], identity="a camera")
        >>> spot = seen_once(camera, TIP, pictures=3)
        >>> spot.x, spot.y
        (312.4, 96.3)
    """
    return median_spot(seen_in(sensor, mark, pictures=pictures))


def seen_in(sensor: TipSensor, mark: int, *, pictures: int) -> tuple[Spot, ...]:
    """Return where a camera sees a mark, in each of the pictures in which it does.

    Args:
        sensor: The camera.
        mark: What is looked for: ``TIP``, or the number of a fiducial.
        pictures: How many are taken.

    Raises:
        CalibrationError: As :func:`seen_once`.

    Example:
        >>> from types import SimpleNamespace
        >>> from robolink import Spot
        >>> from robolink.model import TIP
        >>> from robolink.sensing import seen_in
        >>> answers = iter([[Spot(312.3, 96.3)], [], [Spot(312.4, 96.3)]])
        >>> camera = SimpleNamespace(see=lambda mark: next(answers), identity="a camera")
        >>> [spot.x for spot in seen_in(camera, TIP, pictures=3)]
        [312.3, 312.4]
    """
    spots = list[Spot]()
    for _ in range(pictures):
        found = _seen(sensor, mark)
        if len(found) > 1:
            raise _several(mark, found)
        for spot in found:
            _require_finite(spot, sensor)
        spots += found
    if 2 * len(spots) <= pictures:
        raise _not_seen(mark, sensor, len(spots), pictures)
    return tuple(spots)


def median_spot(spots: Sequence[Spot]) -> Spot:
    """Return the median of each number of some spots; of what none of them tells, ``None``."""
    radii = [spot.radius_px for spot in spots if spot.radius_px is not None]
    scores = [spot.score for spot in spots if spot.score is not None]
    return Spot(
        median(spot.x for spot in spots),
        median(spot.y for spot in spots),
        radius_px=median(radii) if radii else None,
        score=median(scores) if scores else None,
    )


def scatter_of(spots: Sequence[Spot]) -> float | None:
    """Return the standard deviation of one coordinate of one picture, ``None`` of one picture.

    From the lower quartile of the differences between any two, so that one false find among three
    pictures does not make the scatter of the others seem large.
    """
    differences = sorted(
        difference
        for one, other in combinations(spots, 2)
        for difference in (abs(one.x - other.x), abs(one.y - other.y))
    )
    if not differences:
        return None
    return differences[len(differences) // 4] / _QUARTER_OF_DIFFERENCES


def _seen(sensor: TipSensor, mark: int) -> Sequence[Spot]:
    # Whatever a camera's driver raises: it must neither leave the tip down before the lens, nor be
    # taken for a failure of the controller's link.
    # But a stop, and what nobody knows to have happened, stay what they are: a camera that is asked
    # through the controller can meet both.
    try:
        return sensor.see(mark)
    except (StoppedError, OutcomeUnknownError):
        raise
    except Exception as error:
        raise CalibrationError(
            "sensor_failed",
            tr("The camera {camera} failed: {cause}", camera=sensor.identity, cause=error),
            remedy=tr("Check cable, power and program of the camera, then start again."),
        ) from error


def _require_finite(spot: Spot, sensor: TipSensor) -> None:
    # Before anything is calculated from it: the next movement would be.
    finite = math.isfinite(spot.x) and math.isfinite(spot.y)
    radius_px = spot.radius_px
    if finite and (radius_px is None or (math.isfinite(radius_px) and radius_px > 0)):
        return
    told = tr("{camera} answers {x}, {y}.", camera=sensor.identity, x=spot.x, y=spot.y)
    if finite:
        told = tr(
            "{camera} answers with a spot of radius {radius} px.",
            camera=sensor.identity,
            radius=radius_px,
        )
    raise CalibrationError(
        "non_finite",
        told,
        remedy=tr("Restart the camera's program, and look at what it finds in its picture."),
    )


def _not_seen(mark: int, sensor: TipSensor, seen: int, pictures: int) -> CalibrationError:
    where = tr(
        "{camera}: seen in {seen} of {pictures} pictures.",
        camera=sensor.identity,
        seen=seen,
        pictures=pictures,
    )
    if mark == TIP:
        return CalibrationError(
            "tip_not_seen",
            tr("The camera does not see the tip. {where}", where=where),
            remedy=tr(
                "Check light, lens and focus, that the tip is clean, and that the station is where "
                "the camera looks."
            ),
        )
    return CalibrationError(
        "fiducial_not_seen",
        tr("The camera does not see fiducial {mark}. {where}", mark=mark, where=where),
        remedy=tr("Check light and focus, the drawing, and that the board is held as drawn."),
    )


def _several(mark: int, found: Sequence[Spot]) -> CalibrationError:
    places = ", ".join(f"({spot.x:.1f}, {spot.y:.1f})" for spot in found)
    if mark == TIP:
        return CalibrationError(
            "several_tips_seen",
            tr("The camera sees {count} tips, at {places}.", count=len(found), places=places),
            remedy=tr(
                "Only one may be in the image: retract the other nozzle, clean the window, or make "
                "the field of view smaller."
            ),
        )
    return CalibrationError(
        "several_fiducials_seen",
        tr(
            "The camera sees {count} marks that may be fiducial {mark}, at {places}.",
            count=len(found),
            mark=mark,
            places=places,
        ),
        remedy=tr("Only one may be in the image; make the field of view smaller."),
    )
