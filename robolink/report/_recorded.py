"""From the entries of a change in the journal to its report; no controller is needed."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

from robolink.calibration import (
    CalibrationResult,
    Drift,
    TurnJudgement,
    VerifyResult,
    doubt_sentence,
)
from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.model import (
    ControllerFacts,
    EntryKind,
    Pose,
    Recorded,
    ToolOffset,
    answered_by_in_words,
    are_simulated_facts,
    describe_offset,
    from_fields,
    is_simulated_name,
    method_name_now,
    read_offset,
    with_method_name_now,
)
from robolink.remedy_words import RemedyWord, remedy_word
from robolink.report._values import (
    Attempt,
    GaugeOnRecord,
    Judgement,
    Outcome,
    Record,
    Report,
    TouchOnRecord,
)


def recorded_fit(details: Mapping[str, Any]) -> CalibrationResult:
    """Return the result of a measurement, from the details of its entry.

    What older entries do not say is left empty.

    Raises:
        ConfigError, KeyError, TypeError, ValueError: The entry cannot be understood.
    """
    unsaid = {"kept": (), "reference_point_mm": (), "sigma_gain": 1.0, "warnings": ()}
    said = {
        **unsaid,
        **details,
        "evidence": None,
        "method": method_name_now(details["method"]),
        "offset": read_offset(details["proposed"]) or ToolOffset(),
        "inputs": tuple(map(recorded_pose, details.get("poses", ()))),
        "notes": details.get("information", ()),
    }
    return from_fields(CalibrationResult, said, partial=True)


def recorded_pose(pose: Mapping[str, Any]) -> Pose:
    """Return a pose of an entry; it has no key for what the controller does not report."""
    return from_fields(Pose, pose, partial=True)


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
    """Return the controller's own answers at the measurement; none in old entries."""
    return from_fields(ControllerFacts, said or {}, partial=True)


def _touch(said: Mapping[str, Any]) -> TouchOnRecord:
    """Return how a touch was made: the robot stopped beside the pin, or a person jogged to it."""
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
        return Outcome.UNFINISHED, tr("The record does not say how the write ended.")
    declined = any(entry.details.get("accepted") is False for entry in entries)
    return (Outcome.DECLINED if declined else Outcome.PROPOSED), ""


def _end(entries: Sequence[Recorded], end: Recorded) -> tuple[Outcome, str]:
    turned = _last(entries, EntryKind.VERIFY)
    if end.kind is EntryKind.DONE:
        later = tr("A later reading of the controller confirmed it.")
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
    """Return 'before' and 'after', as far as they are recorded.

    The first that says so counts: when an old value is restored, that is written too.
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
    """Return what the first entry of a change of several tools says about one of them."""
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
    """Return the seating in an entry; an old entry has none.

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


_NOT_ABOUT_A_CHANGE = (
    EntryKind.SELECTION,
    EntryKind.LEASE,
    EntryKind.RECONNECT,
    EntryKind.RAW,
    EntryKind.RUN,
    EntryKind.PANEL,
    EntryKind.JOURNAL,
    EntryKind.DECISION,
)
"""Kinds of entries whose tool, if any, was not changed."""


def reports_of(
    entries: Sequence[Recorded],
    *,
    made_at: str,
    robolink_version: str,
    check: str,
    problems: Sequence[str] = (),
) -> tuple[Report, ...]:
    """Return the result for each tool of a change.

    Args:
        entries: All that is on record about the change, in the order in which it was stored.
        made_at: Wall-clock label, ISO 8601.
        robolink_version: What makes the reports.
        check: What a check of the whole journal found, one sentence.
        problems: What is wrong with the journal.

    Raises:
        ConfigError: It changed no tool, or an entry cannot be understood.

    Example:
        >>> from robolink import ToolOffset, connect
        >>> from robolink.report import reports_of
        >>> from robolink.transaction import Wanted, change_tools
        >>> with connect("epson+sim://report-example") as controller:
        ...     receipts = change_tools(controller, [Wanted(2, ToolOffset(5, 6, -70), None)])
        ...     entries = tuple(reversed(list(controller.outcomes.recorded(tool=2))))
        >>> about = {"made_at": "2026-11-23T08:00:00Z", "robolink_version": "0.1.0"}
        >>> (report,) = reports_of(entries, check="The journal is whole.", **about)
        >>> report.tool
        2
    """
    tools = sorted({tool for entry in entries for tool in _tools(entry)})
    if not tools:
        raise ConfigError(
            tr("These entries are not about a change of a tool's offset."),
            remedy=tr(
                "{changes} shows entries that are.", changes=remedy_word(RemedyWord.LIST_CHANGES)
            ),
        )
    record = Record(
        change=entries[-1].change or entries[-1].operation,
        signature=entries[-1].signature,
        people=tuple(dict.fromkeys(_people(entries))),
        entries=tuple(entries),
        check=check,
        problems=tuple(problems),
    )
    made = {"made_at": made_at, "robolink_version": robolink_version}
    return tuple(
        _report(tool, [e for e in entries if _concerns(e, tool)], record, made) for tool in tools
    )


def _report(
    tool: int, entries: Sequence[Recorded], record: Record, made: Mapping[str, str]
) -> Report:
    try:
        return report_of_tool(tool, entries, record, judgements=tuple(_judged(entries)), **made)
    except (KeyError, TypeError, ValueError) as error:
        raise ConfigError(
            tr(
                "The entries {first} to {last} cannot be understood: {error!r}.",
                first=entries[0].number,
                last=entries[-1].number,
                error=error,
            ),
            remedy=tr("'robolink journal verify' tells whether they were changed."),
        ) from error


def _tools(entry: Recorded) -> Iterator[int]:
    if entry.kind in _NOT_ABOUT_A_CHANGE:
        return
    if entry.tool is not None:
        yield entry.tool
    several = entry.details.get("tools")
    if isinstance(several, Mapping):
        yield from (int(tool) for tool in several)


def _concerns(entry: Recorded, tool: int) -> bool:
    """Return whether an entry is about a tool, or about the whole change."""
    if entry.kind in _NOT_ABOUT_A_CHANGE:
        return entry.kind is EntryKind.DECISION and entry.tool in (None, tool)
    return entry.tool in (None, tool)


def _people(entries: Sequence[Recorded]) -> Iterator[str]:
    for entry in entries:
        signed = entry.signature
        role = f" ({signed.role})" if signed.role else ""
        user = tr("user {user} on {host}", user=signed.os_user, host=signed.host)
        yield f"{signed.operator}{role}, {user}" if signed.operator else user + role


def _judged(entries: Sequence[Recorded]) -> Iterator[Judgement]:
    for entry in entries:
        if (entry.tolerance or entry.verdict) and not _stands_in_the_head(entry):
            said = (_answer(entry) or entry.verdict, _fit(entry.details))
            found = "; ".join(part for part in said if part)
            yield Judgement(_what(entry), entry.tolerance, found)


def _stands_in_the_head(entry: Recorded) -> bool:
    """Return whether an entry only repeats which nozzle or lot it was: an older one, unasked."""
    named = entry.verdict and entry.verdict in (entry.signature.nozzle, entry.signature.lot)
    return bool(named) and entry.kind is EntryKind.DECISION and "question" not in entry.details


def _what(entry: Recorded) -> str:
    """Return what a row is about: an answered question says more than its kind."""
    if entry.kind is EntryKind.DECISION and "question" in entry.details:
        return tr("answer")
    return str(entry.kind)


def _answer(entry: Recorded) -> str:
    """Return question, answer and how it was answered; empty if it was no question."""
    details = entry.details
    if entry.kind is not EntryKind.DECISION or "question" not in details:
        return ""
    by = details.get("answered_by")
    if by is None:  # older entries do not contain it
        return tr("{question} {answer}", question=details["question"], answer=entry.verdict)
    return tr(
        "{question} {answer} ({by})",
        question=details["question"],
        answer=entry.verdict,
        by=answered_by_in_words(str(by)),
    )


def _fit(details: Mapping[str, object]) -> str:
    """Return how well a measurement agreed with itself, in words."""
    rms_mm, largest_mm = details.get("rms_mm"), details.get("max_residual_mm")
    if not isinstance(rms_mm, float) or not isinstance(largest_mm, float):
        return ""
    return tr("rms {rms:.3f} mm, largest residual {largest:.3f} mm", rms=rms_mm, largest=largest_mm)
