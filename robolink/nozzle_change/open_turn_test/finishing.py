"""Taking a change up again for its turn test.

Its marker, and no other, lets the robot move, and stays until the verdict: a process that is killed
in the test leaves what it found
(docs/decisions/0013-an-unverified-change-is-taken-back.md).
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from typing import Final

from robolink.calibration import VerifyResult
from robolink.errors import (
    CalibrationError,
    LeaseLostError,
    OutcomeUnknownError,
    RemoteProtocolError,
    RobolinkError,
    TransportError,
    VerifyError,
)
from robolink.messages import joined, tr
from robolink.model import Controller, Finding, Marker, MarkerKind, Verdict
from robolink.nozzle_change._records import tests_on_record
from robolink.nozzle_change._turn_question import Attended
from robolink.nozzle_change._turn_verdict import conclude_turn_test
from robolink.nozzle_change.open_turn_test.marking import OpenTurnTest, tests_of
from robolink.procedures import TOUCH_CODES, KeptProof, MeasurementContext
from robolink.runner import Operator
from robolink.transaction import Settler

_OUT_OF_REACH: Final = (OutcomeUnknownError, TransportError, RemoteProtocolError, LeaseLostError)
"""After these nothing can be put back here: the link is gone, or the right to write."""


def finish_by_turn_test(
    controller: Controller,
    operation: str,
    operator: Operator,
    *,
    attended: bool = False,
    tell: Callable[[int, VerifyResult], None] = lambda _tool, _result: None,
) -> Finding:
    """Make the turn test of an open change, then keep its values or put the old ones back.

    Whatever else ends it puts the old values back too, as it would have in the change itself;
    only where the link or the lease is lost, or this process ends, the change stays open. Call it
    under :meth:`robolink.model.OutcomeLog.hold`, when a person at the robot has agreed to the
    movements.

    Args:
        controller: The controller, connected.
        operation: Of the marker of the change.
        operator: Who brings the tip onto the pin.
        attended: Whether they are asked what follows where it contradicts the measurement, as in
            the change itself; else the old values come back.
        tell: Told of each tool how its test ended.

    Returns:
        What was found, closed: the new values are kept.

    Raises:
        VerifyError: It did not pass, or its touches were not made; the old values are back.
        OutcomeUnknownError: Something else is unsettled, too, or the change has no test, or its
            tools hold other values now; nothing moved.
        RobolinkError: Anything else that ended it, with the state it left.

    Example:
        >>> import robolink
        >>> from robolink.errors import OutcomeUnknownError
        >>> from robolink.nozzle_change import ChangePlan, NozzleChange, ToolPlan
        >>> from robolink.nozzle_change import finish_by_turn_test, open_turn_tests
        >>> from robolink.transaction import recover
        >>> from robolink_cli.prompts.operator import AssistedOperator
        >>> from robolink_simulators.assist.port import InProcessEyes
        >>> from robolink_simulators.epson import EpsonSimulator
        >>> from robolink_simulators.hosting.in_process.epson import register
        >>> simulator, written = EpsonSimulator(), []
        >>> def cut_off(_number, request):  # in the first movement after the write
        ...     written.extend([request] * ("TLSet 1," in request))
        ...     if written and "Move" in request:
        ...         simulator.on_request = None
        ...         simulator.panel.cut_link()
        >>> def somebody(controller):  # jogs the tip onto the pin
        ...     eyes = InProcessEyes(simulator)
        ...     return AssistedOperator.with_eyes(eyes, lambda _: None, clock=controller.clock)
        >>> url, plan = register("turn-test-example", simulator), ChangePlan((ToolPlan(1),))
        >>> simulator.on_request = cut_off
        >>> with robolink.connect(url) as controller:
        ...     try:
        ...         NozzleChange(controller, plan, operator=somebody(controller)).run()
        ...     except OutcomeUnknownError:
        ...         print("cut off")
        cut off
        >>> with robolink.connect(url) as controller:
        ...     (change,) = open_turn_tests(controller)
        ...     _ = recover(controller, later=[change], confirm=lambda _: True)
        ...     with controller.outcomes.hold("turn test"):
        ...         found = finish_by_turn_test(controller, change, somebody(controller))
        ...     str(found.verdict), len(written), controller.outcomes.open_markers()
        ('done', 1, ())
    """
    marker, finding = _open(controller, operation)
    outcomes, request = controller.outcomes, marker.request
    outcomes.change = str(marker.details.get("change", ""))
    try:
        # From here on this marker alone is that of a procedure of this process.
        with controller.uninterrupted():
            controller.begin(MarkerKind.CHANGE, request, marker.details, operation=marker.operation)
        with (
            controller.latch.watching(request),
            controller.preserved(tr("turn test")),
            _put_back_unless_kept(controller, marker),
        ):
            proofs = {
                one.test.tool: _prove(controller, one, operator, tell, attended=attended)
                for one in tests_of(marker)
            }
            finding = _with_statements(finding, proofs)
            Settler(controller, keep=True).settle(finding)
    finally:
        outcomes.change = ""
    return finding


def _open(controller: Controller, operation: str) -> tuple[Marker, Finding]:
    """Return the open change and what its tools hold now.

    Raises:
        OutcomeUnknownError: There is nothing that could be tested.
    """
    for marker in controller.outcomes.open_markers():
        if marker.operation == operation and tests_of(marker):
            finding = Settler(controller, keep=True).examine(marker)
            if finding.verdict is Verdict.DONE:
                return marker, finding
    raise OutcomeUnknownError(
        tr("There is no written value whose turn test could be made now."),
        remedy=tr("Nothing moved. Next: 'robolink recover'."),
        controller=controller.identity,
    )


def _with_statements(finding: Finding, proofs: Mapping[int, VerifyResult]) -> Finding:
    """Return what was found with what each tip is accurate to by its turn test, for the record."""
    entries = []
    for entry in finding.entries:
        proof = None if entry.tool is None else proofs.get(entry.tool)
        said = {} if proof is None else {"accurate_to_mm": proof.accurate_to_mm}
        entries.append(replace(entry, details={**entry.details, **said}))
    return replace(finding, entries=tuple(entries))


def _prove(
    controller: Controller,
    one: OpenTurnTest,
    operator: Operator,
    tell: Callable[[int, VerifyResult], None],
    *,
    attended: bool,
) -> VerifyResult:
    """Make one test; what this change has shown before counts too.

    Raises:
        VerifyError: It did not pass.
    """
    test = one.test
    controller.tools.select(test.tool)
    context = MeasurementContext(
        controller, operator, start=None, settings=lambda _start, _tip: one.settings
    )

    def turned() -> VerifyResult:
        with context.telling(lambda _done: None, tool=test.tool):
            return _touches_counting(controller, test, context)

    person = context.runner(tool=test.tool)
    proof = turned()
    return conclude_turn_test(
        controller,
        test.tool,
        proof,
        claim=test.claim,
        interval_mm=test.interval_mm,
        attended=Attended(person.choose, person.confirm, turned, test.relearning)
        if attended
        else None,
        earlier=tests_on_record(controller.outcomes, test.tool, proof),
        tell=lambda result: tell(test.tool, result),
    )


def _touches_counting(
    controller: Controller, test: KeptProof, context: MeasurementContext
) -> VerifyResult:
    """Make a test; touches that were not made end it as a failed one."""
    try:
        return test.prove_after_a_break(context)
    except CalibrationError as error:
        if error.code not in TOUCH_CODES:
            raise
        raise VerifyError(
            tr("The new tip was not tested. {cause}", cause=error.what),
            remedy=error.remedy,
            code=error.code,
            controller=controller.identity,
        ) from error


@contextmanager
def _put_back_unless_kept(controller: Controller, marker: Marker) -> Iterator[None]:
    """Put the old values back where the block ends early and the controller is within reach."""
    try:
        yield
    except _OUT_OF_REACH:
        raise
    except BaseException as error:
        with controller.uninterrupted():
            told = _put_back(controller, marker)
        if isinstance(error, RobolinkError):
            error.remedy = joined(" ", filter(None, (error.remedy, told)))
        raise


def _put_back(controller: Controller, marker: Marker) -> str:
    """Put the old values back with one write a tool; return what became of it, in words."""
    still = [one.operation for one in controller.outcomes.open_markers()]
    if marker.operation not in still:
        return ""  # kept, or put back, already
    try:
        settler = Settler(controller)
        finding = settler.examine(marker)
        if finding.verdict not in (Verdict.NOT_FINISHED, Verdict.NOT_APPLIED):
            return joined(" ", (finding.sentence, _stays_open()))
        settler.settle(finding)
    except RobolinkError as error:
        return joined(" ", (error.what, _stays_open()))
    finally:
        controller.outcomes.change = str(marker.details.get("change", ""))
    tools = ", ".join(str(one.test.tool) for one in tests_of(marker))
    return tr("The old value of tool {tool} is back.", tool=tools)


def _stays_open() -> str:
    return tr("The change stays open. Next: 'robolink recover'.")
