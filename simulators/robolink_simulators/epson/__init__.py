"""A simulated EPSON SCARA controller with Remote Ethernet and a SPEL+ command window.

The names are loaded when they are first used: the device stands on the world, and the world
on parts of this package.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from robolink_simulators.epson.condition import Mode as Mode
    from robolink_simulators.epson.device import EpsonSimulator as EpsonSimulator
    from robolink_simulators.epson.options import EpsonOptions as EpsonOptions
    from robolink_simulators.epson.options import SpelNumbers as SpelNumbers

__all__ = ["EpsonOptions", "EpsonSimulator", "Mode", "SpelNumbers"]

_HOMES = {
    "EpsonOptions": "options",
    "EpsonSimulator": "device",
    "Mode": "condition",
    "SpelNumbers": "options",
}


def __getattr__(name: str) -> object:
    """Load a public name from its module (PEP 562)."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
