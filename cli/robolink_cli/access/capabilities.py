"""What only some kinds of controllers have."""

from typing import TYPE_CHECKING

from robolink.errors import ConfigError
from robolink.messages import tr

if TYPE_CHECKING:
    from robolink.controllers import EpsonController, SoftMotionController
    from robolink.model import Controller, DigitalIo, PointReader
    from robolink.protocols.epson_text import Preference


def require_epson(controller: "Controller", what: str) -> "EpsonController":
    """Return the controller if it is one of EPSON's.

    Args:
        controller: The controller, connected.
        what: What only those have, for a person.

    Raises:
        ConfigError: It is of another kind.
    """
    from robolink.controllers import EpsonController

    if isinstance(controller, EpsonController):
        return controller
    raise _without(controller, what)


def require_softmotion(controller: "Controller") -> "SoftMotionController":
    """Return the controller if it is a SoftMotion PLC with a mailbox.

    Raises:
        ConfigError: It is of another kind.
    """
    from robolink.controllers import SoftMotionController

    if isinstance(controller, SoftMotionController):
        return controller
    raise _without(controller, tr("SoftMotion axis group"))


def points_of(controller: "Controller") -> "PointReader":
    """Return the taught points of a controller.

    Raises:
        ConfigError: This kind has none.
    """
    points = controller.points
    if points is None:
        raise _without(controller, tr("taught points"))
    return points


def io_of(controller: "Controller") -> "DigitalIo":
    """Return the inputs and outputs of a controller.

    Raises:
        ConfigError: This kind has none.
    """
    io = controller.io
    if io is None:
        raise _without(controller, tr("inputs and outputs"))
    return io


def preferences_of(controller: "Controller") -> "frozenset[Preference] | None":
    """Return the preferences of a controller, ``None`` if it does not report them."""
    from robolink.controllers import EpsonController

    return controller.preferences() if isinstance(controller, EpsonController) else None


def _without(controller: "Controller", what: str) -> ConfigError:
    return ConfigError(
        tr("{controller} has no {what}.", controller=controller.identity, what=what),
        remedy=tr("This is for other kinds of controllers."),
        controller=controller.identity,
    )
