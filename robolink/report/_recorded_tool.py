"""What the journal says about one tool of a change."""

from collections.abc import Mapping, Sequence
from typing import Any, Final

from robolink.calibration import Drift, TurnJudgement, VerifyResult, doubt_sentence
from robolink.messages import tr
from robolink.model import (
    ControllerFacts,
    EntryKind,
    Recorded,
    ToolOffset,
    are_simulated_facts,
    describe_offset,
    is_simulated_name,
    read_offset,
    with_method_name_now,
)
from robolink.report._recorded_fit import recorded_fit, recorded_pose
from robolink.report._values import (
    Attempt,
    GaugeOnRecord,
    Judgement,
    Outcome,
    Record,
    Report,
    TouchOnRecord,
)

_ENDS: Final = {
    EntryKind.NOT_APPLIED: Outcome.NOT_APPLIED,
    EntryKind.ROLLED_BACK: Outcome.ROLLED_BACK,
    EntryKind.CONFLICT: Outcome.CONFLICT,
    EntryKind.UNKNOWN: Outcome.UNFINISHED,
}


def report_of_tool(
    tool: int,
    entries: Sequence[Recorded],
    record: Record,
    *,
    judgements: tuple[Judgement, ...],
    made_at: str,
    robolink_version: str,
) -> Report:
    """Return the report of one tool, without facts and taught points.

    Raises:
        ConfigError, KeyError, TypeError, ValueError: An entry cannot be understood.
    """
    outcome, ending = _outcome(entries)
    measured = _last(entries, EntryKind.CALIBRATION)
    calibration = with_method_name_now(measured.details) if measured else {}
    facts = _facts(calibration.get("facts"))
    compared = _offsets(tool, entries, done=outcome in (Outcome.VERIFIED, Outcome.WRITTEN))
    return Report(
        made_at=made_at,
        robolink_version=robolink_version,
        controller=entries[0].controller,
        facts=facts,
        tool=tool,
        before=compared.get("before"),
        after=compared.get("after"),
        compared=len(compared) == 2,
        outcome=outcome,
        ending=ending,
        source=str(calibration.get("source", "")) or _undoing(entries),
        method=calibration.get("method"),
        determined=(*calibration.get("measured", ()), *calibration.get("changed", ())),
        warnings=(
            *calibration.get("notes", ()),
            *map(doubt_sentence, calibration.get("warnings", ())),
        ),
        poses=tuple(map(recorded_pose, calibration.get("poses", ()))),
        fit=None if measured is None else recorded_fit(calibration),
        attempts=tuple(_attempts(entries)),
        verification=_verification(
            _last(entries, EntryKind.VERIFY), _last(entries, EntryKind.DONE)
        ),
        judgements=judgements,
        record=record,
        local_time=str(calibration.get("local_time", "")),
        gauges=tuple(GaugeOnRecord(**gauge) for gauge in calibration.get("gauges", ())),
        touches=tuple(_touch(said) for said in calibration.get("touches", ()) if said),
        evidence=calibration.get("evidence") or {},
        seating=_seating(calibration.get("seating")),
        simulated=any(entry.details.get("simulated") is True for entry in entries)
        or is_simulated_name(entries[0].controller)
        or are_simulated_facts(facts),
    )


def _facts(said: Mapping[str, Any] | None) -> ControllerFacts:
    """Return what the controller said of itself when it was measured; nothing in old entries."""
    if said is None:
        return ControllerFacts()
    lists = {name: tuple(said.get(name, ())) for name in ("robot_models", "robot_serials")}
    return ControllerFacts(**{**said, **lists})


def _touch(said: Mapping[str, Any]) -> TouchOnRecord:
    """Return how a touch was made; the robot stopped beside the pin or the person brought it."""
    brought = said.get("arrival") is None
    return TouchOnRecord(
        standoff_mm=None if brought else tuple(said["standoff_mm"]),
        jog_mm=None if brought else said["jog_mm"],
        seconds=said["answered_s"],
        typed=said.get("typed", False) is True,
        contact=said["contact"],
    )


def _outcome(entries: Sequence[Recorded]) -> tuple[Outcome, str]:
    """Return how it ended, and what a person must know about that."""
    kinds = [entry.kind for entry in entries]
    ends = [entry for entry in entries if entry.kind in (*_ENDS, EntryKind.DONE)]
    if ends:
        return _end(entries, ends[-1])
    refused = _last(entries, EntryKind.REFUSED)
    refused_at = refused.number if refused else 0
    measured = _last(entries, EntryKind.CALIBRATION)
    if refused and (measured is None or refused_at > measured.number):
        return Outcome.REFUSED, refused.verdict
    if EntryKind.INTENT in kinds:
        return Outcome.UNFINISHED, tr("How the write ended is not on record.")
    declined = any(entry.details.get("accepted") is False for entry in entries)
    return (Outcome.DECLINED if declined else Outcome.PROPOSED), ""


def _end(entries: Sequence[Recorded], end: Recorded) -> tuple[Outcome, str]:
    turned = _last(entries, EntryKind.VERIFY)
    if end.kind is EntryKind.DONE:
        later = tr("Found done by a later look at the controller.")
        ending = later if end.details.get("found_later") else ""
        if not any(entry.kind is EntryKind.WRITE for entry in entries) and not ending:
            return Outcome.SKIPPED, ""
        return (Outcome.VERIFIED if turned else Outcome.WRITTEN), ending
    outcome = _ENDS[end.kind]
    if outcome is Outcome.ROLLED_BACK and turned and not turned.details["passed"]:
        outcome = Outcome.VERIFY_FAILED
    found = end.details.get("value", ...)
    if outcome is Outcome.CONFLICT and found is not ...:
        held = describe_offset(read_offset(found))
        return outcome, end.verdict or tr("It holds {value}.", value=held)
    return outcome, end.verdict


def _offsets(tool: int, entries: Sequence[Recorded], *, done: bool) -> dict[str, ToolOffset | None]:
    """Return 'before' and 'after', as far as they are on record.

    The first that says so counts: when an old value is put back, that is written too.
    """
    found: dict[str, ToolOffset | None] = {}
    for entry in entries:
        for details in (entry.details, _of_several(tool, entry)):
            if "before" in details:
                found.setdefault("before", read_offset(details["before"]))
            if "requested" in details:
                found.setdefault("after", read_offset(details["requested"]))
    measured = _last(entries, EntryKind.CALIBRATION)
    if measured is not None:
        found.setdefault("after", read_offset(measured.details["proposed"]))
    read_back = next((entry for entry in entries if entry.kind is EntryKind.READ_BACK), None)
    if done and read_back is not None:
        found["after"] = read_offset(read_back.details["value"])
    return found


def _undoing(entries: Sequence[Recorded]) -> str:
    """Return which change was undone, empty for none."""
    named = {"undone_change", "back_to_entry"}
    return next((entry.verdict for entry in entries if named & entry.details.keys()), "")


def _of_several(tool: int, entry: Recorded) -> Mapping[str, Any]:
    """Return what the beginning of a change of several tools says about one of them."""
    tools: Any = entry.details.get("tools", {})
    said: Mapping[str, Any] = tools.get(str(tool), {})
    return said


def _attempts(entries: Sequence[Recorded]) -> list[Attempt]:
    return [
        Attempt(entry.verdict, tuple(map(recorded_pose, _list(entry.details.get("poses")))))
        for entry in entries
        if entry.kind is EntryKind.REFUSED
    ]


def _verification(entry: Recorded | None, done: Recorded | None) -> VerifyResult | None:
    if entry is None:
        return None
    details: Mapping[str, Any] = entry.details
    drifts = tuple(Drift(**drift) for drift in details["drifts"])
    return VerifyResult(
        drifts,
        details["tolerance_mm"],
        tuple(details["warnings"]),
        codes=tuple(details.get("codes", ())),
        judgement=TurnJudgement.from_json(said) if (said := details.get("judgement")) else None,
        accurate_to_mm=None if done is None else _length(done.details.get("accurate_to_mm")),
    )


def _seating(said: Mapping[str, Any] | None) -> Mapping[str, Any] | None:
    """Return what an entry says of the seating; of an old one it is not on record.

    Raises:
        KeyError, TypeError: It cannot be understood.
    """
    return None if said is None else {name: said[name] for name in ("within_mm", "changes")}


def _length(value: object) -> float | None:
    return float(value) if isinstance(value, (int, float)) else None


def _list(value: object) -> list[Any]:
    return value if isinstance(value, list) else []


def _last(entries: Sequence[Recorded], kind: EntryKind) -> Recorded | None:
    return next((entry for entry in reversed(entries) if entry.kind is kind), None)
