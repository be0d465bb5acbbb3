"""All checks that apply to a controller, one after the other."""

from robolink.errors import RobolinkError
from robolink.testing.motion_checks import MOVING_CHECKS
from robolink.testing.reading_checks import READING_CHECKS
from robolink.testing.subject import Check, ContractBrokenError, Subject
from robolink.testing.tool_checks import WRITING_CHECKS


def check_controller(subject: Subject, *, writes: bool = True, moves: bool = True) -> None:
    """Hold a controller to everything that its capabilities promise.

    Args:
        subject: The controller.
        writes: Whether the tool of the subject may be written.
        moves: Whether the robot may be moved.

    Raises:
        ContractBrokenError: Names every promise that is broken, a line each.
    """
    with subject.connect() as controller:
        able = controller.capabilities
    checks: tuple[Check, ...] = READING_CHECKS
    if writes and able.tool_write:
        checks += WRITING_CHECKS
    if moves and able.motion:
        checks += MOVING_CHECKS
    broken = []
    for check in checks:
        try:
            check(subject)
        except (ContractBrokenError, RobolinkError) as error:
            broken.append(f"{check.__name__}: {error}")
    if broken:
        raise ContractBrokenError("\n".join(broken))
