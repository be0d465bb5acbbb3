"""What a report says, before it has a form."""

from dataclasses import dataclass
from enum import StrEnum

from robolink.calibration import Impact, VerifyResult
from robolink.model import ControllerFacts, Pose, ToolOffset


class Outcome(StrEnum):
    """What became of the change."""

    PROPOSED = "proposed"
    VERIFIED = "verified"
    WRITTEN = "written"
    SKIPPED = "skipped"
    DECLINED = "declined"
    REFUSED = "refused"
    VERIFY_FAILED = "verify failed"
    UNFINISHED = "unfinished"


@dataclass(frozen=True, slots=True)
class Report:
    """A change of one tool's offset: proposed, written or refused.

    Attributes:
        made_at: Wall-clock label, ISO 8601.
        robolink_version: What made it.
        controller: Identity of the controller, without a password.
        facts: What the controller says about itself.
        tool: Number of the tool.
        before: What is stored, ``None`` for an undefined tool.
        after: The new offset.
        outcome: What became of it.
        ending: Sentences that say why it ended so; empty when it went well.
        source: Where the new offset comes from, one sentence.
        method: How it was measured, ``None`` when it was typed.
        determined: Names of the components that were measured or typed; the others are kept.
        warnings: Doubts, as sentences.
        poses: The flange poses that went in.
        impact: Where taught points lead afterwards, ``None`` when none were named.
        verification: Drift about the new tip, ``None`` when nothing was turned.
    """

    made_at: str
    robolink_version: str
    controller: str
    facts: ControllerFacts
    tool: int
    before: ToolOffset | None
    after: ToolOffset
    outcome: Outcome
    ending: str = ""
    source: str = ""
    method: str | None = None
    determined: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    poses: tuple[Pose, ...] = ()
    impact: Impact | None = None
    verification: VerifyResult | None = None
