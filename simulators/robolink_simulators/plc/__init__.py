"""A simulated PLC with its tool offsets where a map says, which answers as the map says.

How real PLC programs of this kind behave beyond their register list is theirs; the answers
here are the plainest that each handshake allows (assumed).
"""

from robolink_simulators.plc.device import PlcSimulator
from robolink_simulators.plc.serving import PlcHost, serve_plc, serve_plc_line, serve_plc_opcua

__all__ = [
    "PlcHost",
    "PlcSimulator",
    "serve_plc",
    "serve_plc_line",
    "serve_plc_opcua",
]
