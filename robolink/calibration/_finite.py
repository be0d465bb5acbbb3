"""Numbers that are no poses: camera points, beam edges, heights."""

import math

from robolink.errors import CalibrationError
from robolink.messages import tr


def require_finite(**values: float) -> None:
    """Refuse what is not a finite number, by its name.

    Raises:
        CalibrationError: ``non_finite``.
    """
    for name, value in values.items():
        if not isinstance(value, (int, float)) or not math.isfinite(value):
            raise CalibrationError(
                "non_finite",
                tr("{name} is {value!r}.", name=name, value=value),
                remedy=tr("Give finite numbers in mm and degrees."),
            )
