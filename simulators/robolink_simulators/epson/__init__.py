"""A simulated EPSON SCARA controller with Remote Ethernet and a SPEL+ command window.

The names are loaded when they are first used: the device stands on the world, and the world
on parts of this package.
"""

from typing import TYPE_CHECKING

from robolink.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from robolink_simulators.epson.condition import Mode as Mode
    from robolink_simulators.epson.device import EpsonSimulator as EpsonSimulator
    from robolink_simulators.epson.options import EpsonOptions as EpsonOptions
    from robolink_simulators.epson.options import SpelNumbers as SpelNumbers
else:
    __getattr__, __dir__, __all__ = lazy_exports(
        __name__,
        {
            "condition": "Mode",
            "device": "EpsonSimulator",
            "options": "EpsonOptions SpelNumbers",
        },
    )
