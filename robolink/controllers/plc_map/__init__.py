"""PLCs that keep tool offsets in registers of the machine builder's own."""

from typing import TYPE_CHECKING

from robolink.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from robolink.controllers.plc_map.controller import PlcMapController as PlcMapController
    from robolink.controllers.plc_map.controller import open_plc_map as open_plc_map
    from robolink.controllers.plc_map.flange import FlangeReader as FlangeReader

__getattr__ = lazy_exports(
    __name__,
    {
        "controller": "PlcMapController open_plc_map",
        "flange": "FlangeReader",
    },
)
