"""A simulated PLC that keeps tool offsets where a map says, and answers as the map says.

How real PLC programs of this kind behave beyond their register list is theirs; the answers
here are the plainest that each handshake allows (assumed).
"""

from robolink_simulators.plc.device import PlcSimulator as PlcSimulator
from robolink_simulators.plc.serving import PlcHost as PlcHost
from robolink_simulators.plc.serving import serve_plc as serve_plc
from robolink_simulators.plc.serving import serve_plc_line as serve_plc_line
