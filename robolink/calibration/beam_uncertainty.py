"""How the uncertainty of beams goes into a tip that is measured with them.

The equation of one crossing is n'(middle + R t) = distance. Where the beam is off by (d, a),
distance and direction, the crossing is off by d + lever a, the lever being how far along the beam
the tip went through it from where the beam was found. The fit is linear, so the offset is off by
the same mixture of the rows as of their scatter (docs/reference/evidence.md 12).
"""

import math
from collections.abc import Sequence

import numpy as np

from robolink.calibration.beam_lines import Beam, Crossing
from robolink.calibration.core.robust import Floats
from robolink.calibration.core.rotations import rotation_of
from robolink.calibration.quality.station_part import StationPart
from robolink.messages import tr
from robolink.model import ToolOffset


def beams_part(
    design: Floats, crossings: Sequence[Crossing], beams: tuple[Beam, Beam], offset: ToolOffset
) -> StationPart:
    """Return what two beams add to the uncertainty of X and Y.

    Args:
        design: The design matrix of the fit, one row a crossing, X and Y its first two columns.
        crossings: The crossings, in the order of the rows.
        beams: The beams, each with its covariance.
        offset: The tip that was found.
    """
    mixture = np.linalg.pinv(design)[:2]
    through = [_through_mm(crossing, offset) for crossing in crossings]
    total = np.zeros((2, 2))
    for number, beam in enumerate(beams):
        rows = [row for row, crossing in enumerate(crossings) if crossing.beam == number]
        levers = [(1.0, beam.along_mm(*through[row])) for row in rows]
        part = mixture[:, rows] @ np.array(levers)
        total += part @ np.array(beam.covariance) @ part.T
    known = [beam.dof for beam in beams if beam.dof is not None]
    return StationPart(
        tr("place of the beams"),
        total.tolist(),
        dof=min(known, default=math.inf),
        origin=tr("record of the station"),
    )


def _through_mm(crossing: Crossing, offset: ToolOffset) -> tuple[float, float]:
    """Return where the tip went through a beam, base."""
    dx, dy, _ = (rotation_of(crossing.entry) @ np.array(offset.components()[:3])).tolist()
    x_mm, y_mm = crossing.middle_mm
    return x_mm + dx, y_mm + dy
