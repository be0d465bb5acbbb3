"""Looks at the controller while a person is asked: what the second row of a screen shows."""

import time
from collections.abc import Callable

from robolink.errors import ControllerError
from robolink.model import Controller
from robolink_cli.wizard.happenings import Reading


def glancing_at(controller: Controller) -> Callable[[], Reading | None]:
    """Return what looks at a controller, and says what it saw.

    A broken link is not swallowed: whoever asks is told of it, as by any other exchange.
    """
    group = controller.groups[0]

    def look() -> Reading | None:
        status = controller.status()
        halted = status.emergency_stop or status.guard_open or status.fault or status.serious_fault
        # What comes next tells why: a position is no more of interest then.
        if halted:
            return Reading(time.monotonic(), status.state, halted=True)
        try:
            pose = group.pose()
            axes = _joints(group.axes())
        except ControllerError:
            return Reading(time.monotonic(), status.state)
        return Reading(time.monotonic(), status.state, pose=pose, axes=axes)

    return look


def following(controller: Controller) -> Callable[[], Reading | None]:
    """Return what looks at a controller while a movement is under way, beside whoever waits for it.

    Status can be asked meanwhile on every kind; the position only where the kind says so.
    """
    group = controller.groups[0]
    tells = controller.capabilities.pose_while_moving

    def look() -> Reading | None:
        status = controller.status()
        pose = group.pose() if tells else None
        axes = _joints(group.axes()) if tells else ()
        return Reading(time.monotonic(), status.state, pose=pose, axes=axes)

    return look


def _joints(axes: object) -> tuple[float, ...]:
    found = axes.get("joints") or axes.get("axes") or () if isinstance(axes, dict) else ()
    return tuple(found)
