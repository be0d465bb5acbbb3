"""Uncertainty that an imperfectly known camera adds to its measurements.

Where it sees a thing is off by the same vector b everywhere, and by e (s - c) besides, s being
where the thing is seen and c the point that it knows best: the real part of the complex number e
is an error of scale, the imaginary part one of direction, as large. Of one look this makes
u^2 = u_place^2 + (u_scale |s - c|)^2 in every direction (docs/reference/evidence.md 7). Several
marks share b and e; what a method finds for itself, or what cancels between two marks, is not
counted.

How sure its calibration was is on its record. What may have become of it since, and what it sees
of a tip at any time, are rows of the budget (docs/reference/evidence.md 19).
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Final

from robolink.calibration.camera.camera_model import CameraModel, Sighting
from robolink.calibration.core.accuracy import ErrorSource
from robolink.calibration.flange_plane import FlangePlane
from robolink.calibration.quality.station import StationPart
from robolink.messages import tr

USUAL_MM_PER_PX: Final = 0.02
"""Size of a pixel assumed if the camera answers in millimetres and no calibration gives the size:
an image of 1,280 pixels then shows 26 mm."""

USUAL_AWAY_MM: Final = 1.0
"""Distance of a mark from the middle of the image, assumed if the middle is unknown: a new nozzle
sits a few tenths of a millimetre beside the old one."""

_Shifts = list[tuple[float, float]]
"""Displacement of each sighting along base X and Y."""

_AXES: Final = ((1.0, 0.0), (0.0, 1.0))

_STEP_MM = 1e-3

_STEP = 1e-5
"""Step of scale and of direction (rad); 40 mm from the centre it shifts the sighting by 0.4 um."""


def camera_part(
    camera: CameraModel,
    sightings: Sequence[Sighting],
    found: Callable[[Sequence[Sighting]], Sequence[float]],
    *,
    angles: Sequence[int] = (),
) -> StationPart:
    """Return the part of a camera's error in a result from several marks.

    Args:
        camera: The camera, and how sure it is of its place and scale.
        sightings: What it saw.
        found: Returns the measured components of other sightings, mm and degrees.
        angles: Which of these are angles, by their place.
    """
    centre = camera.centre_mm or (
        sum(s.x_mm for s in sightings) / len(sightings),
        sum(s.y_mm for s in sightings) / len(sightings),
    )
    at = complex(*centre)

    def shifted(place: complex, turn: complex) -> list[Sighting]:
        moved = []
        for s in sightings:
            by = place + turn * (complex(s.x_mm, s.y_mm) - at)
            moved.append(replace(s, x_mm=s.x_mm + by.real, y_mm=s.y_mm + by.imag))
        return moved

    columns = []
    for place, turn, sigma in (
        (1.0, 0.0, camera.place_sigma_mm),
        (1j, 0.0, camera.place_sigma_mm),
        (0.0, 1.0, camera.scale_sigma),
        (0.0, 1j, camera.scale_sigma),
    ):
        step = _STEP_MM if place else _STEP
        ahead = found(shifted(place * step, turn * step))
        behind = found(shifted(-place * step, -turn * step))
        change = [a - b for a, b in zip(ahead, behind, strict=True)]
        for index in angles:
            change[index] = math.remainder(change[index], 360.0)
        columns.append([sigma * value / (2 * step) for value in change])
    rows = list(zip(*columns, strict=True))
    return StationPart(
        tr("place and scale of the camera"),
        tuple(tuple(sum(a * b for a, b in zip(r, s, strict=True)) for s in rows) for r in rows),
        origin=tr("record of the station"),
    )


def camera_sources(
    sightings: Sequence[Sighting],
    gains: Sequence[Sequence[float]],
    *,
    camera: CameraModel | None = None,
    finds_place: bool,
) -> tuple[ErrorSource, ...]:
    """Return the errors of looks through a calibrated camera that their scatter does not show.

    What it sees of a tip beside the tip turns with the tool: half a pixel is half a pixel of the
    offset. A turn or a change of scale moves what is seen about the one place that it leaves alone,
    the point that the camera knows best; where the method finds the camera's place that place
    cancels, and what counts is by how much the tip went round in the image.

    Args:
        sightings: What was seen.
        gains: By how much each measured component changes when a sighting is moved: a line for each
            component, X and Y of the base for each sighting, mm or degrees for 1 mm.
        camera: The camera, where it is known.
        finds_place: Whether the method finds what the camera's place is off by.

    Example:
        >>> from robolink import Pose
        >>> from robolink.calibration import CameraModel, Sighting
        >>> from robolink.calibration.camera.camera_uncertainty import camera_sources
        >>> camera = CameraModel(((0.02, 0), (0, 0.02)), (290, 80), centre_mm=(300, 90))
        >>> seen = [Sighting(Pose(287, 93, -60, 0), 300, 92)]
        >>> whole = ((1, 0), (0, 1))
        >>> found = camera_sources(seen, whole, camera=camera, finds_place=False)
        >>> [source.row for source in found]
        ['tip_image_px', 'camera_turn_deg', 'camera_scale_percent', 'place_mm']
        >>> found[2].gain  # 2 mm from the point that it knows best
        ((0.0,), (0.02,))
    """
    ways: dict[str, list[_Shifts]] = {"camera_turn_deg": [], "camera_scale_percent": []}
    for away in _from_middle(sightings, camera, finds_place=finds_place):
        ways["camera_turn_deg"].append([(-y, x) for x, y in away])
        ways["camera_scale_percent"].append(away)
    # A camera that also measures the height has the same error in height.
    lengths = 2 if sightings[0].z_mm is None else 3
    pixel_mm = camera.largest_mm_per_px if camera else USUAL_MM_PER_PX
    found = [ErrorSource.of_lengths("tip_image_px", lengths, gain=pixel_mm)]
    for row, per_unit in (("camera_turn_deg", math.radians(1.0)), ("camera_scale_percent", 0.01)):
        found.append(ErrorSource(row, _moved(gains, ways[row], per_unit), "as_offset"))
    if not finds_place and lengths > 2:
        found.append(ErrorSource.of_lengths("place_mm", lengths, turning="in_base"))
    elif not finds_place:
        alike = [[along] * len(sightings) for along in _AXES]
        found.append(ErrorSource("place_mm", _moved(gains, alike), "in_base"))
    return tuple(found)


def _from_middle(
    sightings: Sequence[Sighting], camera: CameraModel | None, *, finds_place: bool
) -> list[_Shifts]:
    """Return how far marks were seen from the point that a turn of the camera leaves alone.

    Where nobody knows that place, it may lie in either direction.
    """
    count = len(sightings)
    centre = None if camera is None or finds_place else camera.centre_mm
    x_mm, y_mm = centre or (
        sum(s.x_mm for s in sightings) / count,
        sum(s.y_mm for s in sightings) / count,
    )
    away = [[(s.x_mm - x_mm, s.y_mm - y_mm) for s in sightings]]
    if centre is None and not finds_place:
        away += [[(USUAL_AWAY_MM * x, USUAL_AWAY_MM * y)] * count for x, y in _AXES]
    return away


def print_source(
    sightings: Sequence[Sighting],
    gains: Sequence[Sequence[float]],
    marks: Sequence[tuple[float, float]],
) -> ErrorSource:
    """Return the error of fiducials that lie beside their drawing, each in any direction.

    Args:
        sightings: What was seen.
        gains: As for :func:`camera_sources`.
        marks: Which fiducial each sighting shows: where it is in the drawing.

    Example:
        >>> from robolink import Pose
        >>> from robolink.calibration import Sighting
        >>> from robolink.calibration.camera.camera_uncertainty import print_source
        >>> flange = Pose(300, 100, -60, 0)
        >>> seen = Sighting(flange, 320, 100), Sighting(flange, 280, 100)
        >>> middle = ((0.5, 0, 0.5, 0), (0, 0.5, 0, 0.5))
        >>> print_source(seen, middle, [(20, 0), (-20, 0)]).gain
        ((0.5, 0.0, 0.5, 0.0), (0.0, 0.5, 0.0, 0.5))
    """
    columns = []
    for mark in dict.fromkeys(marks):
        for along in _AXES:
            # The error turns with the tool.
            columns.append(
                [
                    FlangePlane.of(s.flange).in_base(*along) if one == mark else (0.0, 0.0)
                    for s, one in zip(sightings, marks, strict=True)
                ]
            )
    return ErrorSource("print_mm", _moved(gains, columns))


def _moved(
    gains: Sequence[Sequence[float]], ways: Sequence[_Shifts], factor: float = 1.0
) -> tuple[tuple[float, ...], ...]:
    """Return by how much the measured components change, for each way to move the sightings."""
    flat = [[value for pair in way for value in pair] for way in ways]
    return tuple(
        tuple(factor * sum(g * by for g, by in zip(line, way, strict=True)) for way in flat)
        for line in gains
    )
