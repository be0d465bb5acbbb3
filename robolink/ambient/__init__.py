"""What a program takes from its surroundings: chance, time, and locks that threads wait at.

Whatever decides how a run goes and is not given to it comes from here, so that a test can give
it instead: the same chance, the same times and the same order of threads give the same run, byte
for byte (docs/decisions/0026-a-machine-that-looks-for-defects.md). A program never replaces them.

What is left out on purpose: the terminal and the sockets of a stop are read against the real
time, since nothing simulated stands behind them.
"""

from robolink.ambient.present import (
    Ambience,
    boot_ns,
    lock,
    monotonic_ns,
    random_bytes,
    random_number,
    reentrant_lock,
    regularly,
    replaced,
    sleep,
    steps_time,
    waiting_room,
    wall_s,
)
from robolink.ambient.waiting import WaitingLock, WaitingRoom

__all__ = [
    "Ambience",
    "WaitingLock",
    "WaitingRoom",
    "boot_ns",
    "lock",
    "monotonic_ns",
    "random_bytes",
    "random_number",
    "reentrant_lock",
    "regularly",
    "replaced",
    "sleep",
    "steps_time",
    "waiting_room",
    "wall_s",
]
