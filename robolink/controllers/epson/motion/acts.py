"""What a person asks of the whole controller: stop, reset, switch the motors."""

from robolink.controllers.epson.link.answers import require_ready
from robolink.controllers.epson.link.link import EpsonLink
from robolink.controllers.epson.link.requests import as_sent
from robolink.controllers.epson.motion.group import EpsonGroup
from robolink.errors import (
    ControllerFaultError,
    NotReadyError,
    NotReadyReason,
    ReadBackError,
)
from robolink.messages import tr
from robolink.model import Act, ControllerStatus, MotionProfile
from robolink.protocols import spel
from robolink.protocols.epson_text import Request


class EpsonActs:
    """Carries them out and proves them."""

    def __init__(self, link: EpsonLink, group: EpsonGroup) -> None:
        self._link = link
        self._session = link.session
        self._window = link.window
        self._group = group

    def reset(self) -> None:
        """See :meth:`~robolink.controllers.EpsonController.reset_fault`."""
        with self._link.lock.held("Reset", calming=True), self._link.latch.restoring():
            self._require_resettable(self._window.status())
            self._session.exchange("Reset")
            status = self._window.status()
            if status.emergency_stop:
                raise ControllerFaultError(
                    tr("The emergency stop is still pressed after the reset."),
                    code=status.code,
                    remedy=tr("Release the button, then reset again."),
                    controller=self._link.identity,
                    request="Reset",
                )
            if status.fault or status.serious_fault:
                raise ControllerFaultError(
                    tr("The reset did not clear error {code:04d}.", code=status.code),
                    code=status.code,
                    remedy=tr("Remove the cause; a serious error needs the power switched off."),
                    controller=self._link.identity,
                    request="Reset",
                )
            if status.remote and status.ready:
                self._group.settings.slow_down(MotionProfile())

    def motors(self, on: bool) -> None:
        """See :meth:`~robolink.controllers.EpsonController.motors`."""
        name = "SetMotorsOn" if on else "SetMotorsOff"
        with self._link.lock.held(name, calming=not on):
            self._window.require_ready(name)
            self._session.exchange(name, str(self.robot_number()))
            if on:
                self._group.settings.slow_down(MotionProfile())
            if self._group.motors_on() is not on:
                raise ReadBackError(
                    tr("The motors are not on.") if on else tr("The motors are not off."),
                    remedy=tr("Look at the controller; nothing was repeated."),
                    controller=self._link.identity,
                    request=name,
                )

    def robot_number(self) -> int:
        """Read which robot motors and statements act on."""
        (number,) = self._session.exchange("GetCurRobot").fields
        return spel.parse_integer(number)

    def preview(self, act: Act) -> tuple[str, ...]:
        """Return the requests of an act, as they stand on the wire."""
        if act is Act.STOP:
            return tuple(as_sent(Request(request)) for request in ("Abort", "Stop"))
        if act is Act.RESET:
            return (as_sent(Request("Reset")),)
        name = "SetMotorsOn" if act is Act.MOTORS_ON else "SetMotorsOff"
        return (as_sent(Request(name, (str(self.robot_number()),))),)

    def _require_resettable(self, status: ControllerStatus) -> None:
        # The flag of an emergency stop stays on after its release until the reset
        # (docs/reference/epson.md 1.7), so it cannot hold the reset back.
        if status.serious_fault or status.running or not status.remote:
            require_ready(status, controller=self._link.identity, request="Reset")
        if status.guard_open:
            raise NotReadyError(
                tr("The safety guard is open."),
                reason=NotReadyReason.GUARD_OPEN,
                remedy=tr("Close it before the reset."),
                controller=self._link.identity,
                request="Reset",
            )
