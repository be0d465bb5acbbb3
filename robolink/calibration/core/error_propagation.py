"""How errors of measured positions reach the result of a calculation."""

from collections.abc import Callable

import numpy as np

from robolink.calibration.core.robust import Floats

_STEP_MM = 1e-4


def sensitivity(calculate: Callable[[Floats], Floats], measured_mm: Floats) -> Floats:
    """Return by how much ``calculate(measured_mm)`` changes per mm, a row for each input.

    The derivative is taken by central differences; the calculations are smooth, and a step of
    0.1 um leaves eight digits.
    """
    flat = measured_mm.ravel()
    rows = []
    for index in range(flat.size):
        step = np.zeros_like(flat)
        step[index] = _STEP_MM
        ahead = calculate((flat + step).reshape(measured_mm.shape))
        behind = calculate((flat - step).reshape(measured_mm.shape))
        rows.append((ahead - behind) / (2 * _STEP_MM))
    return np.array(rows)
