"""robolink: measure, write and test tool offsets on robot controllers.

::

    with robolink.connect("epson+tcp://192.168.0.1:5000", password="...") as controller:
        print(controller.status())
        print(controller.tools.read(1))

Names are loaded when they are first used, so that importing the package costs nothing.
"""

from typing import TYPE_CHECKING

from robolink.lazy_exports import lazy_exports
from robolink.version import VERSION

__version__ = VERSION

if TYPE_CHECKING:
    from robolink.controllers import connect as connect
    from robolink.errors import RobolinkError as RobolinkError
    from robolink.model import ANY as ANY
    from robolink.model import Controller as Controller
    from robolink.model import Pose as Pose
    from robolink.model import Secret as Secret
    from robolink.model import Spot as Spot
    from robolink.model import SpotUnit as SpotUnit
    from robolink.model import TipSensor as TipSensor
    from robolink.model import ToolOffset as ToolOffset
    from robolink.model import from_json as from_json
    from robolink.model import to_json as to_json
    from robolink.runner import Operator as Operator
    from robolink.runner import Question as Question

__getattr__, __dir__, __all__ = lazy_exports(
    __name__,
    {
        "controllers": "connect",
        "errors": "RobolinkError",
        "model": "ANY Controller Pose Secret Spot SpotUnit TipSensor ToolOffset from_json to_json",
        "runner": "Operator Question",
    },
)
