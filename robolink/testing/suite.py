"""All checks that apply to a controller in turn, and a map that counts as compared for them."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from traceback import extract_tb
from typing import Final

from robolink.controllers import PlcMapController
from robolink.errors import ConfigError, RobolinkError
from robolink.messages import tr
from robolink.model import Controller
from robolink.register_maps import ComparedValue, Confirmation, confirm, values_of
from robolink.testing.motion_checks import MOVING_CHECKS, WRITING_WHILE_MOVING_CHECKS
from robolink.testing.reading_checks import READING_CHECKS
from robolink.testing.subject import Check, ContractBrokenError, Subject
from robolink.testing.tool_checks import WRITING_CHECKS

_BY: Final = "robolink.testing"


def confirm_whole_map(controller: Controller) -> Confirmation:
    """Record, under the name of this package, that every value of a map was compared.

    Never at a machine: there a person compares (``robolink expert plc check-map``).

    Raises:
        ConfigError: It is no PLC with a map, or it cannot be stored.
        RobolinkError: The PLC does not say who it is.
    """
    if not isinstance(controller, PlcMapController):
        raise ConfigError(
            tr("{url} is not a PLC with a map.", url=controller.identity),
            remedy=tr("This is for other kinds of controllers."),
        )
    register_map = controller.register_map
    compared = [ComparedValue(value, "") for value in values_of(register_map)]
    return confirm(controller.who().name, register_map, by=_BY, compared=compared)


@dataclass(frozen=True, slots=True)
class CheckOutcome:
    """The result of one check.

    Attributes:
        name: Of the check.
        promise: What is promised, in a sentence.
        broken: What was found in place of it; empty where it is kept.
        error: The error that kept the check from being made, ``None`` for none: the controller
            may just be in a state in which it refuses.
    """

    name: str
    promise: str
    broken: str = ""
    error: RobolinkError | None = None


def outcomes(subject: Subject, checks: Iterable[Check] = READING_CHECKS) -> Iterator[CheckOutcome]:
    """Check some promises of a controller, one after the other, and report each.

    Args:
        subject: The controller.
        checks: Which; by default those that only read.
    """
    for check in checks:
        broken, kept_from = "", None
        try:
            check(subject)
        except ContractBrokenError as error:
            broken = str(error)
        except RobolinkError as error:
            broken, kept_from = str(error), error
            if found := _found_before(error):
                broken = f"{found}; {broken}"
        except (Exception, SystemExit) as error:
            # Users of a controller catch one family of errors; a driver must raise no others, and
            # must not end the process.
            broken = f"{type(error).__name__} at {_place_of(error)} is no RobolinkError"
            broken += f": {_said_by(error)}"
        promise = " ".join((check.__doc__ or "").split())
        yield CheckOutcome(check.__name__, promise, broken, kept_from)


def _found_before(error: BaseException) -> str:
    """Return what was broken before the check could restore anything."""
    context = error.__context__
    while context is not None and not isinstance(context, ContractBrokenError):
        context = context.__context__
    return "" if context is None else str(context)


def _place_of(error: BaseException) -> str:
    raised = extract_tb(error.__traceback__)[-1]
    return f"{Path(raised.filename).name}:{raised.lineno}"


def _said_by(error: BaseException) -> str:
    """Return the text of an error, which may be one that cannot even show that."""
    try:
        return str(error)
    except Exception:
        return "(it has no text)"


def check_controller(subject: Subject, *, writes: bool = True, moves: bool = True) -> None:
    """Check everything that a controller's capabilities promise.

    Args:
        subject: The controller.
        writes: Whether the tool of the subject may be written.
        moves: Whether the robot may be moved.

    Raises:
        ContractBrokenError: Names every promise that is broken, a line each.

    Example:
        >>> from robolink.controllers import SimpleController, SimpleMachine
        >>> from robolink.testing import Subject, check_controller
        >>> machine = SimpleMachine()
        >>> check_controller(Subject(lambda: SimpleController(machine), tool=2), moves=False)
    """
    with subject.connect() as controller:
        able = controller.capabilities
    checks: tuple[Check, ...] = READING_CHECKS
    if writes and able.tool_write:
        checks += WRITING_CHECKS
    if moves and able.motion:
        checks += MOVING_CHECKS
        checks += WRITING_WHILE_MOVING_CHECKS if writes and able.tool_write else ()
    broken = [f"{it.name}: {it.broken}" for it in outcomes(subject, checks) if it.broken]
    if broken:
        raise ContractBrokenError("\n".join(broken))
