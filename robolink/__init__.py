"""robolink: measure, write and prove tool offsets on robot controllers.

::

    with robolink.connect("epson+tcp://192.168.0.1:5000", password="...") as controller:
        print(controller.status())
        print(controller.tools.read(1))

Names are loaded when they are first used, so that importing the package costs nothing.
"""

from typing import TYPE_CHECKING

__version__ = "0.1.0"

if TYPE_CHECKING:
    from robolink.controllers import connect as connect
    from robolink.errors import RobolinkError as RobolinkError
    from robolink.model import ANY as ANY
    from robolink.model import Pose as Pose
    from robolink.model import Secret as Secret
    from robolink.model import ToolOffset as ToolOffset

__all__ = ["ANY", "Pose", "RobolinkError", "Secret", "ToolOffset", "connect"]

_HOMES = {
    "connect": "robolink.controllers",
    "RobolinkError": "robolink.errors",
    "ANY": "robolink.model",
    "Pose": "robolink.model",
    "Secret": "robolink.model",
    "ToolOffset": "robolink.model",
}


def __getattr__(name: str) -> object:
    """Load a public name from its home (PEP 562)."""
    if name not in _HOMES:
        raise AttributeError(f"module 'robolink' has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *_HOMES])
