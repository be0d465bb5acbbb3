"""What an expression or a statement can reach."""

import random
from dataclasses import dataclass

from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.options import EpsonOptions


@dataclass(frozen=True, slots=True)
class Session:
    """The machine, the controller's habits, and the dice of RealPos."""

    machine: Machine
    options: EpsonOptions
    rng: random.Random
