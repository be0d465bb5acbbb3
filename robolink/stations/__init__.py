"""Reference stations: pins, light beams, surfaces, cameras in a cell, by name.

What a person knows about a station stands in the cell file; where a measurement found it is kept
in the journal, and counts from then on. docs/stations.md explains both.
"""

from typing import TYPE_CHECKING

from robolink.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from robolink.stations._base import base_now as base_now
    from robolink.stations._base import learnt_elsewhere as learnt_elsewhere
    from robolink.stations._base import require_base_of as require_base_of
    from robolink.stations._finding import find_station as find_station
    from robolink.stations._finding import find_stations as find_stations
    from robolink.stations._places import beam_station as beam_station
    from robolink.stations._places import camera_station as camera_station
    from robolink.stations._places import pin_of as pin_of
    from robolink.stations._places import sensor_of as sensor_of
    from robolink.stations._places import touch_station as touch_station
    from robolink.stations._records import Found as Found
    from robolink.stations._records import station_entry as station_entry
    from robolink.stations._records import station_of as station_of
    from robolink.stations._sensors import BeamStation as BeamStation
    from robolink.stations._sensors import CameraStation as CameraStation
    from robolink.stations._sensors import TouchStation as TouchStation
    from robolink.stations._station import AGREEING_MM as AGREEING_MM
    from robolink.stations._station import Gauge as Gauge
    from robolink.stations._station import Station as Station
    from robolink.stations._station import StationKind as StationKind
else:
    __getattr__, __dir__, __all__ = lazy_exports(
        __name__,
        {
            "_base": "base_now learnt_elsewhere require_base_of",
            "_finding": "find_station find_stations",
            "_places": "beam_station camera_station pin_of sensor_of touch_station",
            "_records": "Found station_entry station_of",
            "_sensors": "BeamStation CameraStation TouchStation",
            "_station": "AGREEING_MM Gauge Station StationKind",
        },
    )
