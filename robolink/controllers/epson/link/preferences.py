"""The preferences set in the controller, as far as its firmware tells them.

Two of them make a measurement worthless and everything else look right: in a dry run the robot
is not moved, and with virtual I/O no input is a real one, while each answer is as ever. Firmware
that knows the query tells them (docs/reference/epson.md 1.11); older firmware answers 11, and then
nothing is assumed and nothing is said. They are asked for at most once a connection, since a
change restarts the controller.
"""

from contextlib import suppress

from robolink.controllers.epson.link.session import EpsonSession
from robolink.errors import (
    NotReadyError,
    NotReadyReason,
    RejectedError,
    RemoteProtocolError,
)
from robolink.messages import tr
from robolink.protocols.epson_text import Preference, parse_preferences


class Preferences:
    """What is set in one controller.

    Args:
        session: Asks for it, when it is needed first.
    """

    def __init__(self, session: EpsonSession) -> None:
        self._session = session
        self._asked = False
        self._told: frozenset[Preference] | None = None

    def read(self) -> frozenset[Preference] | None:
        """Return the preferences that are on, ``None`` where the firmware does not tell.

        Raises:
            TransportError, RemoteProtocolError: The session is over.
        """
        pending = self._session.pending
        if not self._asked and (pending is None or pending.answer is not None):
            self._told = self._ask()
            self._asked = True
        return self._told

    def _ask(self) -> frozenset[Preference] | None:
        try:
            fields = self._session.exchange("GetContSettings").fields
        except RejectedError:
            return None  # not known to this firmware, or not to be had now
        # In a form that is not known it tells nothing; verify-controller shows what it was.
        with suppress(RemoteProtocolError):
            return parse_preferences(",".join(fields))
        return None

    def require_real_motion(self, request: str) -> None:
        """Hold ``request`` back while the robot would only seem to move.

        Raises:
            NotReadyError: The controller is set to dry run.
        """
        if Preference.DRY_RUN in (self.read() or ()):
            raise NotReadyError(
                tr("The controller is set to dry run: the robot would only seem to move."),
                reason=NotReadyReason.DRY_RUN,
                remedy=tr(
                    "Nothing was sent. Switch the preference 'Dry run' off in RC+ (the controller "
                    "restarts), then try again."
                ),
                controller=self._session.identity,
                request=request,
            )

    def require_real_inputs(self, request: str) -> None:
        """Hold ``request`` back while no input is a real one.

        Raises:
            NotReadyError: The controller is set to virtual I/O.
        """
        if Preference.VIRTUAL_IO in (self.read() or ()):
            raise NotReadyError(
                tr("The controller is set to virtual I/O: none of its inputs is a real one."),
                reason=NotReadyReason.VIRTUAL_IO,
                remedy=tr(
                    "Nothing was sent. Switch the preference 'Virtual I/O' off in RC+ (the "
                    "controller restarts), then try again."
                ),
                controller=self._session.identity,
                request=request,
            )

    def require_real(self, request: str) -> None:
        """Hold a measurement, or the writing of one, back while the cell is not the real one.

        Putting an old value back is let through: left alone, an unproved one would stay in force.

        Raises:
            NotReadyError: Dry run or virtual I/O.
        """
        if self._session.latch.restores:
            return
        self.require_real_motion(request)
        self.require_real_inputs(request)
