"""The content of a report, before it has a form."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, ClassVar

from robolink.calibration import CalibrationResult, Impact, VerifyResult
from robolink.model import ControllerFacts, Pose, Recorded, Signature, ToolOffset


class Outcome(StrEnum):
    """How the change ended."""

    PROPOSED = "proposed"
    VERIFIED = "verified"
    WRITTEN = "written"
    SKIPPED = "skipped"
    DECLINED = "declined"
    REFUSED = "refused"
    VERIFY_FAILED = "verify failed"
    NOT_APPLIED = "not applied"
    ROLLED_BACK = "rolled back"
    CONFLICT = "conflict"
    UNFINISHED = "unfinished"


@dataclass(frozen=True, slots=True)
class Judgement:
    """What was judged in the process, in words.

    Attributes:
        what: What it was about.
        allowed: The limits.
        found: The verdict.
    """

    what: str
    allowed: str
    found: str


@dataclass(frozen=True, slots=True)
class GaugeOnRecord:
    """A gauge that was measured against.

    Attributes:
        id: As on its certificate.
        station: The station at which it stands.
        due: Until when its calibration holds, ISO 8601; empty where nobody stated it.
        overdue: Whether that was over when it was measured.
    """

    id: str
    station: str
    due: str = ""
    overdue: bool = False


@dataclass(frozen=True, slots=True)
class TouchOnRecord:
    """How a person made one touch.

    Attributes:
        standoff_mm: How far from where the tip was expected the robot had stopped, x, y and z;
            ``None`` for a touch to which the person brought the tip.
        jog_mm: How far the person jogged it from there, ``None`` likewise.
        seconds: How long that took.
        contact: Whether an input was seen to switch meanwhile; ``None`` where none was watched.
        typed: Whether its pose was typed.
    """

    standoff_mm: tuple[float, ...] | None
    jog_mm: float | None
    seconds: float | None
    contact: bool | None
    typed: bool = False


@dataclass(frozen=True, slots=True)
class Attempt:
    """A measurement that was refused.

    Attributes:
        why: What was wrong with it.
        poses: The flange poses that were taken; they were not used.
    """

    why: str
    poses: tuple[Pose, ...]


@dataclass(frozen=True, slots=True)
class Record:
    """What the journal adds to the report of a change: the same for all of its tools.

    Attributes:
        change: Id of the change.
        signature: With what it was done, as the entry says that ended it.
        people: Who took part, in the order in which they did.
        entries: What is on record, in the order in which it was stored.
        check: What a check of the whole journal found, one sentence.
        problems: What is wrong with the journal, one sentence each.
    """

    json_version: ClassVar[int] = 5
    change: str
    signature: Signature
    people: tuple[str, ...]
    entries: tuple[Recorded, ...]
    check: str
    problems: tuple[str, ...] = ()


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
        after: The new offset, ``None`` for an undefined tool.
        outcome: What became of it.
        ending: Sentences that say why it ended so; empty when it went well.
        source: Where the new offset comes from, one sentence.
        method: How it was measured, ``None`` when it was typed.
        determined: Names of the components that were measured or typed; the others are kept.
        warnings: Doubts, as sentences.
        poses: The flange poses that went in.
        fit: What the measurement came to, ``None`` when nothing was measured.
        impact: Where taught points lead afterwards, ``None`` when none were named.
        verification: Drift about the new tip, ``None`` when nothing was turned.
        compared: Whether ``before`` and ``after`` are known; a measurement that was refused
            early comes to nothing.
        attempts: Measurements that were refused.
        judgements: What was judged on the way.
        record: What the journal adds, ``None`` for a report that is made on the way.
        local_time: When it was measured by the clock of the place, ISO 8601 with its distance
            from UTC; empty where that is not on record.
        gauges: The gauges that were measured against.
        touches: How the touches were made by which it was measured.
        evidence: Figures of the checks that the measurement went through, plain JSON.
        seating: How differently nozzles sit in this cell, plain JSON; ``None`` where that is not on
            record.
        simulated: Whether it was obtained from a simulated controller; where it is not set,
            nothing says so.
    """

    json_version: ClassVar[int] = 5
    made_at: str
    robolink_version: str
    controller: str
    facts: ControllerFacts
    tool: int
    before: ToolOffset | None
    after: ToolOffset | None
    outcome: Outcome
    ending: str = ""
    source: str = ""
    method: str | None = None
    determined: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    poses: tuple[Pose, ...] = ()
    fit: CalibrationResult | None = None
    impact: Impact | None = None
    verification: VerifyResult | None = None
    compared: bool = True
    attempts: tuple[Attempt, ...] = ()
    judgements: tuple[Judgement, ...] = ()
    record: Record | None = None
    local_time: str = ""
    gauges: tuple[GaugeOnRecord, ...] = ()
    touches: tuple[TouchOnRecord, ...] = ()
    evidence: Mapping[str, Any] = field(default_factory=dict, hash=False)
    seating: Mapping[str, Any] | None = field(default=None, hash=False)
    simulated: bool = False

    @property
    def widened_mm(self) -> float | None:
        """What the tip is accurate to by a wider statement that a person accepted, or ``None``."""
        own_mm = None if self.fit is None else self.fit.accurate_to_mm
        now_mm = None if self.verification is None else self.verification.accurate_to_mm
        return None if now_mm is None or (own_mm is not None and now_mm <= own_mm) else now_mm
