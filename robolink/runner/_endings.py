"""What ends a step, or the whole: the controller's state, and an input that switched too early."""

from collections.abc import Iterator
from contextlib import contextmanager

from robolink.errors import CalibrationError, NotReadyError, NotReadyReason
from robolink.messages import tr
from robolink.model import ControllerStatus


def ended_by(status: ControllerStatus) -> str:
    """Return why a controller goes on with nothing, empty where it does."""
    if status.serious_fault:
        return tr("The controller reported a serious error.")
    if status.emergency_stop:
        return tr("The emergency stop was pressed.")
    if status.guard_open:
        return tr("The safety guard was opened.")
    if status.fault:
        return tr("The controller went into error {code:04d}.", code=status.code)
    return ""


class EndingWatch:
    """Looks for what ends a procedure while a person is asked.

    A controller that tells of its drives has lost them when they had power before: an emergency
    stop of a PLC shows in nothing else. Where they never had power, a person moves the machine in
    another way.

    Example:
        >>> from robolink.model import ControllerStatus
        >>> from robolink.runner import EndingWatch
        >>> watch = EndingWatch()
        >>> watch.obstacle(ControllerStatus(remote=True, ready=True))
        ''
        >>> watch.obstacle(ControllerStatus(remote=True, unpowered=True))
        'The motors went off.'
    """

    def __init__(self) -> None:
        self._had_power = False

    def obstacle(self, status: ControllerStatus) -> str:
        """Return why nothing goes on, empty where it does."""
        off = status.unpowered or status.disabled
        lost, self._had_power = off and self._had_power, self._had_power or not off
        return ended_by(status) or (tr("The motors went off.") if lost else "")


@contextmanager
def as_measurement() -> Iterator[None]:
    """Let an input that has switched too early count as a bad measurement."""
    try:
        yield
    except NotReadyError as error:
        if error.reason is not NotReadyReason.EDGE_PASSED:
            raise
        raise CalibrationError("edge_passed", error.what, remedy=error.remedy) from error
