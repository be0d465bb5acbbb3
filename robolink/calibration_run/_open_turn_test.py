"""A value with an open turn test: kept in a durable marker, reported, and tested later.

Whoever finds the marker open later takes the change up again: it, and no other, lets the robot
move, and stays until the verdict, so that a process that is killed in the test leaves what it found
(docs/decisions/0013-an-unverified-change-is-taken-back.md).
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import astuple, dataclass, replace
from functools import cache
from typing import TYPE_CHECKING, Any, Final, TypeVar, cast

from robolink.calibration import VerifyResult
from robolink.calibration_run._plan import Limits, ToolPlan
from robolink.calibration_run._proposal import Proposal
from robolink.calibration_run._records import tests_on_record
from robolink.calibration_run._turn_test import (
    Attended,
    conclude_turn_test,
    relearning_commands,
    touches_counting,
)
from robolink.errors import (
    ConfigError,
    LeaseLostError,
    OutcomeUnknownError,
    RemoteProtocolError,
    RobolinkError,
    TransportError,
)
from robolink.messages import joined, tr
from robolink.methods import find_method
from robolink.model import Controller, Finding, Marker, MarkerKind, Verdict
from robolink.procedures import KeepsProof, KeptProof, MeasurementContext
from robolink.runner import Operator, RunSettings
from robolink.transaction import Settler

if TYPE_CHECKING:
    from pydantic import TypeAdapter


KeptT = TypeVar("KeptT")

_KEY: Final = "turn_tests"
UNTESTED: Final = "untested"


@dataclass(frozen=True, slots=True)
class OpenTurnTest:
    """What a change keeps of the turn test of one tool until it is made.

    Attributes:
        test: The test.
        settings: Limits and speeds, about where the flange was when the change began.
    """

    test: KeptProof
    settings: RunSettings


def marked_turn_tests(
    context: MeasurementContext, limits: Limits, proposals: Sequence[tuple[ToolPlan, Proposal]]
) -> dict[str, object]:
    """Return what the marker of a change keeps of its turn tests, plain JSON.

    Where one of its tools has none that could be made later, what it was measured with, and why.

    Args:
        context: Where the change began.
        limits: Where and how fast the robot may go.
        proposals: What is to be written.
    """
    tests, untested = list[dict[str, object]](), dict[str, object]()
    for plan, proposal in proposals:
        kept = _kept(context, limits, plan, proposal)
        if isinstance(kept, str):
            untested[str(proposal.tool)] = {"method": proposal.result.method, "why": kept}
        else:
            tests.append(kept)
    return {UNTESTED: untested} if untested else {_KEY: tests}


def _kept(
    context: MeasurementContext, limits: Limits, plan: ToolPlan, proposal: Proposal
) -> dict[str, object] | str:
    """Return the test of one tool, or why it has none."""
    source, start = plan.moving, context.start
    if source is None or start is None:
        return "no_motion"
    if not plan.verify:
        return "not_wanted"
    if not isinstance(source, KeepsProof):
        return "no_proof"
    test = source.proof(
        context,
        proposal.tool,
        proposal.result,
        tip=proposal.tip,
        tolerance_mm=plan.criteria.drift_tolerance_mm,
    )
    test = replace(
        test,
        claim=proposal.claim,
        interval_mm=plan.criteria.interval_mm,
        relearning=relearning_commands(context.controller, plan, proposal.result),
    )
    settings = limits.settings(start, proposal.result.offset)
    if not all(map(math.isfinite, astuple(settings.box))):
        return "no_box"
    return test.obstacle or {
        "method": test.method,
        "test": _adapter(type(test)).dump_python(test, mode="json"),
        "settings": _adapter(RunSettings).dump_python(settings, mode="json"),
    }


def open_turn_tests(controller: Controller) -> dict[str, tuple[OpenTurnTest, ...]]:
    """Return the turn tests missing from open changes, by the operations of their markers.

    Only of changes whose tools all hold the new values now. Reads only.

    Args:
        controller: The controller, connected.

    Raises:
        RobolinkError: It cannot be read.
    """
    settler = Settler(controller, keep=True, only_looks=True)
    found = {}
    for marker in controller.outcomes.open_markers():
        tests = tests_of(marker)
        if tests and settler.examine(marker).verdict is Verdict.DONE:
            found[marker.operation] = tests
    return found


def tests_of(marker: Marker) -> tuple[OpenTurnTest, ...]:
    """Return what a marker keeps; nothing if it is unreadable or of another kind."""
    kept, tools = marker.details.get(_KEY), marker.details.get("tools")
    if marker.kind is not MarkerKind.CHANGE or not isinstance(kept, list):
        return ()
    try:
        tests = tuple(map(_read, kept))
    except (ValueError, ConfigError):
        return ()
    named = {str(one.test.tool) for one in tests}
    return tests if isinstance(tools, dict) and named == set(tools) else ()


def _read(kept: Mapping[str, object]) -> OpenTurnTest:
    """Return a test that was stored.

    Raises:
        ConfigError: No method of that name is installed.
        ValueError: It is none.
    """
    proof = find_method(str(kept.get("method"))).proof
    if proof is None:
        raise ValueError("a method without a proof of its own")
    return OpenTurnTest(
        _adapter(proof()).validate_python(kept.get("test")),
        _adapter(RunSettings).validate_python(kept.get("settings")),
    )


def _adapter(kind: type[KeptT]) -> "TypeAdapter[KeptT]":
    return _made_adapter(cast("type", kind))


@cache
def _made_adapter(kind: type) -> "TypeAdapter[Any]":
    from pydantic import TypeAdapter  # needed only when a change begins or is still open

    return TypeAdapter(kind)


_OUT_OF_REACH: Final = (OutcomeUnknownError, TransportError, RemoteProtocolError, LeaseLostError)
"""After these errors nothing can be restored here: the link or the right to write is lost."""


def finish_by_turn_test(
    controller: Controller,
    operation: str,
    operator: Operator,
    *,
    attended: bool = False,
    tell: Callable[[int, VerifyResult], None] = lambda _tool, _result: None,
) -> Finding:
    """Make the turn test of an open change, then keep its values or restore the old ones.

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
        OutcomeUnknownError: Another job is unfinished, or the change has no test, or its
            tools hold other values now; nothing moved.
        RobolinkError: Anything else that ended it, with the state it left.

    Example:
        >>> import robolink
        >>> from robolink.errors import OutcomeUnknownError
        >>> from robolink.calibration_run import ChangePlan, NozzleChange, ToolPlan
        >>> from robolink.calibration_run import finish_by_turn_test, open_turn_tests
        >>> from robolink.transaction import recover
        >>> from robolink_cli.prompts.operator import AssistedOperator
        >>> from robolink_simulators.control.assist import InProcessEyes
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
    with controller.procedure(request):
        outcomes.change = str(marker.details.get("change", ""))
        try:
            # From here on, the marker belongs to a procedure of this process only.
            with controller.uninterrupted():
                controller.begin(
                    MarkerKind.CHANGE, request, marker.details, operation=marker.operation
                )
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
    """Return the open change and the present values of its tools.

    Raises:
        OutcomeUnknownError: There is nothing that could be tested.
    """
    for marker in controller.outcomes.open_markers():
        if marker.operation == operation and tests_of(marker):
            finding = Settler(controller, keep=True).examine(marker)
            if finding.verdict is Verdict.DONE:
                return marker, finding
    raise OutcomeUnknownError(
        tr("There is no written value that could be tested now."),
        remedy=tr("Nothing moved. Next: 'robolink recover'."),
        controller=controller.identity,
    )


def _with_statements(finding: Finding, proofs: Mapping[int, VerifyResult]) -> Finding:
    """Return the findings with what each tip is accurate to by its turn test, for the record."""
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
    """Make one test; earlier results of this change count too.

    Raises:
        VerifyError: It did not pass.
    """
    test = one.test
    controller.tools.select(test.tool)
    context = MeasurementContext(
        controller, operator, start=None, settings=lambda _start, _tip: one.settings
    )

    def turned() -> VerifyResult:
        with (
            context.telling(lambda _done: None, tool=test.tool),
            touches_counting(controller),
        ):
            return test.prove_after_a_break(context)

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


@contextmanager
def _put_back_unless_kept(controller: Controller, marker: Marker) -> Iterator[None]:
    """Restore the old values if the block ends early and the controller is reachable."""
    try:
        yield
    except _OUT_OF_REACH:
        raise
    except BaseException as error:
        with controller.uninterrupted():
            told = _put_back(controller, marker)
        if isinstance(error, RobolinkError):
            error.say_what_stands(told)
        raise


def _put_back(controller: Controller, marker: Marker) -> str:
    """Restore the old values with one write a tool; return the outcome, in words."""
    still = [one.operation for one in controller.outcomes.open_markers()]
    if marker.operation not in still:
        return ""  # already kept or restored
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


def untested_sentences(controller: Controller) -> list[str]:
    """Return why written changes keep no turn test, and how to measure and test them anew.

    Args:
        controller: The controller, connected.

    Raises:
        RobolinkError: It cannot be read.
    """
    settler = Settler(controller, keep=True, only_looks=True)
    told = list[str]()
    for marker in controller.outcomes.open_markers():
        if marker.kind is not MarkerKind.CHANGE or tests_of(marker):
            continue
        if settler.examine(marker).verdict is Verdict.DONE:
            told += _whys(marker)
    return told


def _whys(marker: Marker) -> Iterator[str]:
    """Yield a sentence for each tool of a change that cannot be tested now."""
    untested = marker.details.get(UNTESTED)
    if not isinstance(untested, dict):
        yield tr("The record does not say how to test this change.")
        return
    for tool, entry in untested.items():
        method, why = str(entry.get("method", "")), str(entry.get("why", ""))
        yield joined(" ", (_why(tool, method, why), _anew(method, why)))


def _why(tool: str, method: str, why: str) -> str:
    sentences = {
        "no_motion": tr(
            "Tool {tool} was measured from existing poses: nothing moves, so there is no "
            "turn test.",
            tool=tool,
        ),
        "not_wanted": tr("Tool {tool} was written without a turn test, as requested.", tool=tool),
        "no_box": tr(
            "The allowed area for the turn test of tool {tool} is not on record.", tool=tool
        ),
        "camera_open": tr(
            "The camera that measured tool {tool} was opened by another program: robolink "
            "cannot open it.",
            tool=tool,
        ),
        "camera_token": tr(
            "The address of the camera that measured tool {tool} contains a token, which "
            "robolink does not store.",
            tool=tool,
        ),
    }
    return sentences.get(why) or tr(
        "{method}, which measured tool {tool}, has no turn test that can be made later.",
        method=method,
        tool=tool,
    )


def _anew(method: str, why: str) -> str:
    """Return which command measures and tests, once this is recovered."""
    by_motion = "two-pose" if why == "no_motion" else method
    return tr(
        "When this job is finished or undone, 'robolink calibrate {method}' measures and "
        "tests the tool.",
        method=by_motion,
    )
