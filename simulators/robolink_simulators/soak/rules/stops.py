"""Stopped means stopped: from the first instant of a stop until a person releases it."""

import math
from typing import Final

from robolink.controllers.controller_core import ControllerCore
from robolink_simulators.cell.frames import Frame
from robolink_simulators.soak.computer import VirtualProcess
from robolink_simulators.soak.plant.machine import SentKind, SentRequest
from robolink_simulators.soak.rules.so_far import Grounds

_MOVED_MM: Final = 0.01


class StopRules:
    """Looks at what leaves and what moves once somebody stops.

    Args:
        grounds: What the rules rest on.
    """

    def __init__(self, grounds: Grounds) -> None:
        self._on = grounds
        self._rest: Frame | None = None

    def begin(self) -> None:
        """Begin an hour."""
        self._rest = None

    def leaving(self, process: VirtualProcess, sent: SentRequest) -> None:
        """Check that no movement leaves a process in which a stop has begun."""
        if sent.kind is not SentKind.MOVE:
            return
        self._rest = None
        self._on.hold(
            "StillAfterStop",
            not process.held_back,
            f"{sent.text} leaves process {process.number} after a stop has begun in it",
        )

    def acknowledged(self) -> None:
        """Check the machine when a stop is acknowledged; from now on it stands there."""
        self._on.hold("AtRestWhenStopped", not self._on.plant.moving, "it still moves")
        if not self._on.plant.calls_back:
            self._rest = self._on.plant.flange()

    def held(self, process: VirtualProcess, controller: ControllerCore, what: str) -> None:
        """Check that a latch is closed in a process in which somebody has stopped."""
        self._on.hold(
            "StillAfterStop",
            controller.latch.closed or not process.held_back,
            f"the latch of process {process.number} is open after {what}",
        )

    def passed(self) -> None:
        """Check, after an event, that what was acknowledged as stopped stands where it stood."""
        if self._rest is None or (self._on.plant.bent and not self._on.plant.numbered):
            return  # a request that the wire held up cannot be told apart where it has no number
        now = self._on.plant.flange()
        self._on.hold(
            "AtRestWhenStopped",
            now is not None and math.dist(now.shift_mm, self._rest.shift_mm) <= _MOVED_MM,
            f"the flange is at {now}, and a stop was acknowledged when it was at {self._rest}",
        )
