"""A map that counts as compared, for tests in which nobody stands at a machine's screen."""

from typing import Final

from robolink.controllers import PlcMapController
from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.model import Controller
from robolink.register_maps import ComparedValue, Confirmation, confirm, values_of

_BY: Final = "robolink.testing"


def confirm_whole_map(controller: Controller) -> Confirmation:
    """Put on record, under the name of this package, that every value of a map was compared.

    Never at a machine: there a person compares (``robolink expert plc check-map``).

    Raises:
        ConfigError: It is no PLC with a map, or it cannot be stored.
        RobolinkError: The PLC does not say who it is.
    """
    if not isinstance(controller, PlcMapController):
        raise ConfigError(
            tr("{url} is not a PLC with a map.", url=controller.identity),
            remedy=tr("This is for other kinds of controllers."),
        )
    register_map = controller.register_map
    compared = [ComparedValue(value, "") for value in values_of(register_map)]
    return confirm(controller.who().name, register_map, by=_BY, compared=compared)
