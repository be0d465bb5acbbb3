"""What a camera that is not known exactly adds to what it measured.

Where it sees a thing is off by the same vector b everywhere, and by e (s - c) besides, s being
where the thing is seen and c the point that it knows best: the real part of the complex number e
is an error of scale, the imaginary part one of direction, as large. Of one look this makes
u^2 = u_place^2 + (u_scale |s - c|)^2 in every direction (docs/reference/evidence.md 7). Several
marks share b and e; what a method finds for itself, or what cancels between two marks, is not
counted.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from robolink.calibration.camera.camera_model import CameraModel
from robolink.calibration.quality.station_part import StationPart
from robolink.messages import tr

if TYPE_CHECKING:
    from robolink.calibration.camera.up_camera import Sighting

_STEP_MM = 1e-3

_STEP = 1e-5
"""Of scale and direction; 40 mm from the centre it shifts what is seen by 0.4 um."""


def camera_part(
    camera: CameraModel,
    sightings: "Sequence[Sighting]",
    found: "Callable[[Sequence[Sighting]], Sequence[float]]",
    *,
    angles: Sequence[int] = (),
) -> StationPart:
    """Return the part of a camera's error in what was found from several marks.

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

    def shifted(place: complex, turn: complex) -> "list[Sighting]":
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
