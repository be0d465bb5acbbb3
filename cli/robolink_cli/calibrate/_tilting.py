"""Whether a robot can tilt its tool, and what to do instead of driving it there."""

from typing import NoReturn

from robolink.errors import CalibrationError, ConfigError
from robolink.messages import tr
from robolink.model import Controller
from robolink_cli._context import open_controller
from robolink_cli.calibrate._frame import Frame

_LEAST_AXES = 5
"""X, Y, Z and a turn take four; whatever tilts needs another one."""


def refuse_live(frame: Frame, method: str) -> NoReturn:
    """Say why a method with tilted poses is not driven, and what to do instead; reads only.

    Raises:
        CalibrationError: ``rank_deficient``: this robot cannot tilt its tool at all.
        ConfigError: It can, or does not tell; but robolink drives no tilted poses.
    """
    with open_controller(frame.context) as controller:
        axes = _axes(controller)
        models = ", ".join(controller.facts().robot_models) or controller.identity
    if 0 < axes < _LEAST_AXES:
        raise CalibrationError(
            "rank_deficient",
            tr(
                "{robot} has {axes} axes and turns its tool about Z only, so {method} cannot be "
                "measured with it: nothing shows Z and the tilt of the tool.",
                robot=models,
                axes=axes,
                method=method,
            ),
            remedy=tr(
                "Measure X and Y with 'calibrate n-angle' and Z with 'calibrate z-touch' or "
                "'calibrate one-touch'."
            ),
        )
    raise ConfigError(
        tr(
            "robolink drives no tilted poses, with {robot} either: it takes them as they were "
            "taught.",
            robot=models,
        ),
        remedy=tr("Teach them on the pendant and give --points, or give --pose or --poses."),
    )


def _axes(controller: Controller) -> int:
    counted = controller.groups[0].axes() if controller.groups else {}
    return max((len(values) for name, values in counted.items() if name != "pulses"), default=0)
