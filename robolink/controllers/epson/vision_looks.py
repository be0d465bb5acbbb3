"""Looks through the controller's own vision system: robolink_vision.prg.

VRun is for programs only (docs/reference/vision.md 1), so a look is a program that is started,
and its result is read from Global Preserve variables when it has ended.
"""

from collections.abc import Iterable, Mapping
from typing import Final

from robolink.controllers.driver_link import MarkedCommand
from robolink.controllers.epson.link import EpsonLink
from robolink.controllers.epson.session import as_sent
from robolink.controllers.epson.values import EpsonVariables
from robolink.errors import (
    ConfigError,
    ControllerFaultError,
    OutcomeUnknownError,
    RejectedError,
)
from robolink.messages import tr
from robolink.model import Marker, NewEntry, Spot
from robolink.protocols.epson_text import ErrorCode, Request, VariableType
from robolink.timing import Deadline

_MARK: Final = "robolink_look_mark"
_BEGIN: Final = "robolink_look_begin"
_END: Final = "robolink_look_end"
_ERROR: Final = "robolink_look_error"
_COUNT: Final = "robolink_look_count"
_PLACES: Final = "robolink_look_xy"
_MOST_PLACES: Final = 16

_LONGEST_S: Final = 15.0
"""Longest time for a look, in s: a picture takes some tenths of a second, so a longer one hangs."""

_POLL_S: Final = 0.02
_UNSEEN_S: Final = 1.0
"""Time in s in which a program need not show as running: its flag may follow the answer to Start
(assumed)."""


class EpsonLooks:
    """Takes looks, one at a time, while the robot stands still.

    Args:
        link: The controller.
        variables: Its Global Preserve variables.
    """

    def __init__(self, link: EpsonLink, variables: EpsonVariables) -> None:
        self._link = link
        self._variables = variables

    def require_program(self) -> None:
        """Check that the project publishes looks; reads only.

        Raises:
            ConfigError: It does not.
        """
        try:
            _whole(self._variables, _END)
        except RejectedError as error:
            if error.code != ErrorCode.NO_SUCH_VARIABLE:
                raise
            raise ConfigError(
                tr("The project in the controller has no robolink_vision.prg."),
                remedy=tr(
                    "Write it with 'robolink expert spel export', add it to the project, build."
                ),
            ) from error

    def look(self, mark: int, *, program: int) -> tuple[Spot, ...]:
        """See :meth:`robolink.controllers.EpsonController.look`."""
        self._variables.write(_MARK, mark, VariableType.LONG)
        request = Request("Start", (str(program),))
        shown = as_sent(request)
        with self._link.lock.held(shown):
            self._link.window.require_ready(shown)
            look = _Look(self._link, self._variables, request)
            failure, places = self._link.carry_out(look)
        if failure:
            text = self._link.window.error_text(failure)
            raise ControllerFaultError(
                tr("The vision program ended with error {code}: {text}", code=failure, text=text),
                code=failure,
                remedy=tr("Check its sequences, their calibration and the camera in RC+."),
                request=shown,
            )
        return places


class _Look(MarkedCommand[tuple[int, tuple[Spot, ...]]]):
    """The start of the program, marked until it is known to have ended."""

    def __init__(self, link: EpsonLink, variables: EpsonVariables, start: Request) -> None:
        super().__init__(as_sent(start))
        self._link = link
        self._variables = variables
        self._start = start
        self._before = _whole(variables, _END)

    @property
    def details(self) -> Mapping[str, object]:
        # Only a person can tell what a program of the project did.
        return {"raw": True}

    def send(self) -> None:
        self._link.session.exchange(self._start.name, *self._start.parameters)

    def read(self) -> tuple[int, tuple[Spot, ...]]:
        """Wait for the end of the program; return its error, 0 for none, and what it saw.

        Raises:
            OutcomeUnknownError: It did not end well, or published nothing: what it did instead
                only a person can tell.
        """
        clock, variables = self._link.clock, self._variables
        until, unseen = Deadline.after(clock, _LONGEST_S), Deadline.after(clock, _UNSEEN_S)
        while True:
            status = self._link.window.status()
            rests = not status.running and status.ready
            if rests and (end := _whole(variables, _END)) != self._before:
                break
            stands = not status.running and unseen.remaining_s() <= 0
            if stands or status.fault or status.emergency_stop or until.remaining_s() <= 0:
                raise self._failed(status.code)
            clock.sleep(_POLL_S)
        failure, count = _whole(variables, _ERROR), _whole(variables, _COUNT)
        numbers = self._numbers(count) if 0 < count <= _MOST_PLACES else ()
        if _whole(variables, _BEGIN) != end or not 0 <= count <= _MOST_PLACES:
            raise self._failed(0)
        return failure, tuple(map(Spot, numbers[::2], numbers[1::2]))

    def refusal(self, marker: Marker, error: RejectedError) -> Iterable[NewEntry]:  # noqa: ARG002 - none is kept
        return ()

    def _failed(self, code: int) -> OutcomeUnknownError:
        cause = ControllerFaultError(
            tr("The vision program did not end normally, or published nothing."),
            code=code,
            controller=self._link.identity,
        )
        return self._link.markers.unproved(self.request, cause)

    def _numbers(self, count: int) -> tuple[float, ...]:
        values = self._variables.read_array(_PLACES, (0,), VariableType.DOUBLE, count=2 * count)
        return tuple(float(value) for value in values)


def _whole(variables: EpsonVariables, name: str) -> int:
    return int(variables.read(name, VariableType.LONG))
