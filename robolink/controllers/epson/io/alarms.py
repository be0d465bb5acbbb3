"""Alarms: what the controller wants looked after, apart from errors.

Source: docs/reference/epson.md 1.2.
"""

from robolink.controllers.epson.link.link import EpsonLink
from robolink.errors import ConfigError, ControllerFaultError, RemoteProtocolError
from robolink.messages import tr
from robolink.protocols import spel

_HIGHEST = 99_999


class EpsonAlarms:
    """The alarms that stand. GetAlm exists from RC+ 7 on; older firmware refuses it (11)."""

    def __init__(self, link: EpsonLink) -> None:
        self._session = link.session
        self._window = link.window
        self._lock = link.lock

    def list(self) -> tuple[int, ...]:
        """Read the numbers of the alarms.

        Raises:
            RejectedError: This firmware does not know the request.
        """
        count, *numbers = self._session.exchange("GetAlm").fields
        if spel.parse_integer(count) != len(numbers):
            raise RemoteProtocolError(
                tr(
                    "{count} alarms were announced, but {found} arrived.",
                    count=count,
                    found=numbers,
                ),
                remedy=tr("Keep this text and report it with the controller's firmware version."),
                controller=self._session.identity,
                request="GetAlm",
            )
        return tuple(spel.parse_integer(number) for number in numbers)

    def reset(self, number: int) -> None:
        """Reset one alarm because a person asked for it, and prove that it is gone.

        Raises:
            NotReadyError: The state forbids it, monitoring only and a running program
                included: the conditions of ResetAlm are not documented.
            RejectedError: No such alarm stands, or the firmware does not know the request.
            ControllerFaultError: The alarm is still there.
        """
        if isinstance(number, bool) or not 0 < number <= _HIGHEST:
            raise ConfigError(
                tr("{number!r} is not an alarm's number.", number=number),
                remedy=tr("'robolink status' shows the alarms that are on."),
            )
        request = f"ResetAlm,{number}"
        with self._lock.held(request, calming=True):
            self._window.require_ready(request)
            self._session.exchange("ResetAlm", str(number))
            if number in self.list():
                raise ControllerFaultError(
                    tr("Alarm {number} is still there after its reset.", number=number),
                    code=number,
                    remedy=tr("Remove the cause; the alarm list in RC+ names it."),
                    controller=self._session.identity,
                    request=request,
                )
