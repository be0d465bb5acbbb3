"""Reference stations: pins, light beams, surfaces, cameras in a cell, by name.

What a person knows about a station stands in the cell file; where a measurement found it is kept
in the journal, and counts from then on. docs/stations.md explains both.
"""

from typing import TYPE_CHECKING

from robolink.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from robolink.stations._lookup import base_now as base_now
    from robolink.stations._lookup import find_station as find_station
    from robolink.stations._lookup import find_stations as find_stations
    from robolink.stations._lookup import learnt_elsewhere as learnt_elsewhere
    from robolink.stations._lookup import require_base_of as require_base_of
    from robolink.stations._lookup import stations_on_record as stations_on_record
    from robolink.stations._places import BeamStation as BeamStation
    from robolink.stations._places import CameraStation as CameraStation
    from robolink.stations._places import TouchStation as TouchStation
    from robolink.stations._places import beam_station as beam_station
    from robolink.stations._places import camera_station as camera_station
    from robolink.stations._places import pin_of as pin_of
    from robolink.stations._places import sensor_of as sensor_of
    from robolink.stations._places import touch_station as touch_station
    from robolink.stations._station import AGREEING_MM as AGREEING_MM
    from robolink.stations._station import TAUGHT as TAUGHT
    from robolink.stations._station import Found as Found
    from robolink.stations._station import Gauge as Gauge
    from robolink.stations._station import Station as Station
    from robolink.stations._station import StationKind as StationKind
    from robolink.stations._station import station_entry as station_entry
    from robolink.stations._station import station_of as station_of
    from robolink.stations._teaching import Taught as Taught
    from robolink.stations._teaching import shape_stated as shape_stated
    from robolink.stations._teaching import teaching_entry as teaching_entry
else:
    __getattr__, __dir__, __all__ = lazy_exports(
        __name__,
        {
            "_lookup": (
                "base_now find_station find_stations learnt_elsewhere require_base_of "
                "stations_on_record"
            ),
            "_places": (
                "BeamStation CameraStation TouchStation beam_station camera_station "
                "pin_of sensor_of touch_station"
            ),
            "_station": (
                "AGREEING_MM TAUGHT Found Gauge Station StationKind station_entry station_of"
            ),
            "_teaching": "Taught shape_stated teaching_entry",
        },
    )
