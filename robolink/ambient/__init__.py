"""What a program takes from its surroundings: chance, time, and locks that threads wait at.

Whatever decides how a run goes and is not given to it comes from here, so that a test can give
it instead: the same chance, the same times and the same order of threads give the same run, byte
for byte (docs/decisions/0026-a-machine-that-looks-for-defects.md). A program never replaces them.

What is left out on purpose: the terminal and the sockets of a stop are read against the real
time, since nothing simulated stands behind them.
"""

from robolink.ambient.present import Ambience as Ambience
from robolink.ambient.present import boot_ns as boot_ns
from robolink.ambient.present import lock as lock
from robolink.ambient.present import monotonic_ns as monotonic_ns
from robolink.ambient.present import random_bytes as random_bytes
from robolink.ambient.present import random_number as random_number
from robolink.ambient.present import reentrant_lock as reentrant_lock
from robolink.ambient.present import regularly as regularly
from robolink.ambient.present import replaced as replaced
from robolink.ambient.present import sleep as sleep
from robolink.ambient.present import steps_time as steps_time
from robolink.ambient.present import waiting_room as waiting_room
from robolink.ambient.present import wall_s as wall_s
from robolink.ambient.waiting import WaitingLock as WaitingLock
from robolink.ambient.waiting import WaitingRoom as WaitingRoom
