"""What a change keeps of its turn tests in its durable marker, and how it is read back.

Whoever finds the marker open later takes the change up again
(docs/decisions/0013-an-unverified-change-is-taken-back.md).
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass, replace
from functools import cache
from typing import TYPE_CHECKING, Any, Final, TypeVar, cast

from robolink.errors import ConfigError
from robolink.methods import find_method
from robolink.model import Controller, Marker, MarkerKind, Verdict
from robolink.nozzle_change._plan import Limits, ToolPlan
from robolink.nozzle_change._proposal import Proposal
from robolink.nozzle_change._turn_question import relearning_commands
from robolink.procedures import KeepsProof, KeptProof, MeasurementContext
from robolink.runner import RunSettings
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
    """Return the test of one tool, or why there is none."""
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
    """Return the turn tests that open changes still lack, by the operations of their markers.

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
    """Return what a marker keeps; nothing where it is not that of such a change, or unreadable."""
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
    """Return a test that was kept.

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
    from pydantic import TypeAdapter  # only a change that is open, or begins, needs it

    return TypeAdapter(kind)
