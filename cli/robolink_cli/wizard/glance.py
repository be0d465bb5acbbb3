"""Reads the controller, at rest and in motion, for the second row of a screen."""

import time
from typing import Final

from robolink.errors import ControllerError
from robolink.model import Controller
from robolink_cli.wizard.happenings import Reading

_SELDOM_S: Final = 3.0
"""Interval in seconds at which motors and power mode are read at rest. Only a person or this
program changes them.
"""


class ControllerGlance:
    """Reads one controller, and shows what it read, and nothing else.

    A broken link is not swallowed: whoever asks is told of it, as by any other exchange.

    Args:
        controller: The controller, connected.
    """

    def __init__(self, controller: Controller) -> None:
        self._controller = controller
        self._group = controller.groups[0]
        self._can = controller.capabilities
        self._motors: bool | None = None
        self._low_power: bool | None = None
        self._seldom_s = -_SELDOM_S

    def at_rest(self) -> Reading | None:
        """Read while a person is asked."""
        status = self._controller.status()
        halted = status.emergency_stop or status.guard_open or status.fault or status.serious_fault
        # The next message gives the reason; the position no longer matters.
        if halted:
            self._seldom_s = -_SELDOM_S
            return Reading(time.monotonic(), status.state, halted=True)
        try:
            pose = self._group.pose()
            axes = _joints(self._group.axes())
            self._look_seldom()
        except ControllerError:
            return Reading(time.monotonic(), status.state)
        return Reading(
            time.monotonic(),
            status.state,
            pose=pose,
            axes=axes,
            motors=self._motors,
            low_power=self._low_power,
        )

    def on_the_way(self) -> Reading | None:
        """Read during a movement, beside its waiter.

        Status can be asked meanwhile on every kind; the position only where the kind says so. The
        driver has proved the power mode before the movement began.
        """
        status = self._controller.status()
        tells = self._can.pose_while_moving
        self._motors = True if self._can.motors else None
        self._low_power = True if self._can.low_power else None
        return Reading(
            time.monotonic(),
            status.state,
            pose=self._group.pose() if tells else None,
            axes=_joints(self._group.axes()) if tells else (),
            motors=self._motors,
            low_power=self._low_power,
        )

    def _look_seldom(self) -> None:
        now_s = time.monotonic()
        if now_s - self._seldom_s < _SELDOM_S:
            return
        self._motors = self._group.motors_on() if self._can.motors else None
        self._low_power = self._group.low_power() if self._can.low_power else None
        self._seldom_s = now_s


def _joints(axes: object) -> tuple[float, ...]:
    found = axes.get("joints") or axes.get("axes") or () if isinstance(axes, dict) else ()
    return tuple(found)
