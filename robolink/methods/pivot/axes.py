"""Whether a robot can tilt its tool."""

from typing import Final

from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import Controller

_LEAST_AXES: Final = 5
"""X, Y, Z and a turn take four; whatever tilts needs another one."""


def require_tilting(controller: Controller, method: str) -> None:
    """Refuse a method with tilted poses on a robot of four axes; reads only.

    A machine that does not tell its axes is not refused here: what it cannot take up shows when it
    has moved.

    Raises:
        CalibrationError: ``rank_deficient``.
    """
    axes = _axes(controller)
    if not 0 < axes < _LEAST_AXES:
        return
    raise CalibrationError(
        "rank_deficient",
        tr(
            "{robot} has {axes} axes and turns its tool about Z only, so {method} cannot be "
            "measured with it: nothing shows Z and the tilt of the tool.",
            robot=", ".join(controller.facts().robot_models) or controller.identity,
            axes=axes,
            method=method,
        ),
        remedy=tr(
            "Measure X and Y with 'calibrate n-angle' and Z with 'calibrate z-touch' or "
            "'calibrate one-touch'."
        ),
    )


def _axes(controller: Controller) -> int:
    counted = controller.groups[0].axes() if controller.groups else {}
    return max((len(values) for name, values in counted.items() if name != "pulses"), default=0)
