"""A map that counts as compared, for tests in which nobody stands at a machine's screen."""

from robolink.controllers.plc_map import PlcMapController
from robolink.register_maps import Comparison, Confirmation, confirm, values_of

_BY = "robolink.testing"


def confirm_whole_map(controller: PlcMapController) -> Confirmation:
    """Put on record, under the name of this package, that every value of a map was compared.

    Never at a machine: there a person compares (``robolink expert plc check-map``).

    Raises:
        ConfigError: It cannot be stored.
        RobolinkError: The PLC does not say who it is.
    """
    register_map = controller.register_map
    compared = [Comparison(value, "") for value in values_of(register_map)]
    return confirm(controller.who().name, register_map, by=_BY, compared=compared)
