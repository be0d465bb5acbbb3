"""PLCs that keep tool offsets in registers of the machine builder's own."""

from typing import TYPE_CHECKING

from robolink.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from robolink.controllers.plc_map.controller import PlcMapController as PlcMapController
    from robolink.controllers.plc_map.flange import FlangeReader as FlangeReader
    from robolink.controllers.plc_map.opening import open_plc_map as open_plc_map

__getattr__ = lazy_exports(
    __name__,
    {
        "controller": "PlcMapController",
        "flange": "FlangeReader",
        "opening": "open_plc_map",
    },
)
