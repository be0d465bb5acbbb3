"""PLCs that keep tool offsets in registers of the machine builder's own."""

from robolink.controllers.plc_map.controller import PlcMapController as PlcMapController
from robolink.controllers.plc_map.flange import FlangeReader as FlangeReader
from robolink.controllers.plc_map.opening import open_plc_map as open_plc_map
