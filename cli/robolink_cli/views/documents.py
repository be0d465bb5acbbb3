"""What commands show: plain payloads, and the tables made from them."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from robolink.messages import tr
from robolink.model import (
    COMPONENTS,
    Controller,
    ToolOffset,
    angle_difference_deg,
    json_fields,
    json_value,
    of_no_tool,
)
from robolink_cli.console.render import say, table
from robolink_cli.console.shell_words import hand_words, power_words, state_word

if TYPE_CHECKING:
    from robolink.calibration import CalibrationResult, VerifyResult
    from robolink.calibration_run import Proposal
    from robolink.model import Finding, Pose, ToolReceipt


def pose_payload(pose: "Pose") -> dict[str, object]:
    """Return a pose with its units in the keys."""
    payload = json_fields(pose, *COMPONENTS, "hand", "local", "tool")
    return payload if pose.posture is None else payload | json_fields(pose, "posture")


def receipt_payload(receipt: "ToolReceipt") -> dict[str, object]:
    """Return the result of a write or clear."""
    offsets = ("before", "requested", "read_back")
    return json_fields(receipt, "tool", *offsets, "skipped", "unconditional")


def proposal_payload(proposal: "Proposal") -> dict[str, object]:
    """Return a calibration's proposal next to what is stored."""
    result = proposal.result
    return {
        "tool": proposal.tool,
        "method": result.method,
        "before": json_value(proposal.before),
        "proposed": json_value(result.offset),
        **json_fields(proposal, "tip", "notes"),
        **json_fields(result, "measured", "changed"),
        **json_fields(proposal, "kept", "change_mm"),
        **json_fields(result, "reference_point_mm", "sigma_gain", "warnings"),
        "poses": [pose_payload(pose) for pose in result.inputs],
        **_touches_payload(result.inputs),
        "fit": fit_payload(result),
        "length": length_payload(proposal),
        "seating": json_value(proposal.seating),
        **result.details(),
    }


def _touches_payload(poses: "Sequence[Pose]") -> dict[str, object]:
    """Return how each touch was made, as in the journal; ``None`` if nobody touched."""
    from robolink.calibration_run import touches_made  # here, because a status needs no numpy

    return {"touches": None, "standoff_seed": None, **touches_made(poses)}


def length_payload(proposal: "Proposal") -> dict[str, object] | None:
    """Return what the heights of the touches show about the length, ``None`` for nothing."""
    told = proposal.length
    if told is None:
        return None
    told_of = ("changed", "height_change_mm", "u_mm", "limit_mm", "stored_z_mm")
    written = "difference" if told.changed and proposal.z_from == "measured" else "keep"
    return {**json_fields(told, *told_of, "z_by_difference_mm"), "written": written}


def fit_payload(result: "CalibrationResult") -> dict[str, object]:
    """Return a measurement's repeatability and accuracy; ``None`` for the unknown.

    ``half_width95``, ``interval_from``, ``region95_radius_mm`` and ``budget`` are what it is
    repeatable to, as before there was a statement of accuracy.
    """
    from robolink.calibration import chain_of  # here, because a status needs no numpy

    chain = chain_of(result)
    accuracy = result.accuracy
    return {
        **json_fields(result, "repeatable_to_mm", "accurate_to_mm"),
        "accuracy": accuracy.as_json(result.measured) if accuracy else None,
        "half_width95": dict(zip(result.measured, result.half_width95, strict=False)),
        **json_fields(result, "sigma_mm", "sigma_stated"),
        "interval_from": result.interval_from or None,
        **json_fields(result, "region95_radius_mm", "notes", "budget", "evidence"),
        **json_fields(result, "rms_mm", "max_residual_mm", "residuals_mm", "rejected"),
        **json_fields(result, "condition_number", "dof", "unobservable"),
        "chain": json_fields(chain, "changes", "sigma_mm") if chain else None,
    }


def verification_payload(result: "VerifyResult | None") -> dict[str, object] | None:
    """Return the drift about the new tip."""
    if result is None:
        return None
    drift = ("u_deg", "dx_mm", "dy_mm", "dz_mm", "distance_mm")
    return {
        **json_fields(result, "max_drift_mm", "tolerance_mm", "passed"),
        **json_fields(result, "judgement", "accurate_to_mm"),
        "drifts": [json_fields(one, *drift) for one in result.drifts],
        **_touches_payload(result.inputs),
    }


def finding_payload(finding: "Finding") -> dict[str, object]:
    """Return what was found out about an open marker."""
    return {
        **json_fields(finding.marker, "operation", "kind", "request", "begun_at"),
        **json_fields(finding, "verdict", "sentence", "action"),
    }


def status_payload(controller: "Controller") -> dict[str, object]:
    """Return the flags, and what more can be read now."""
    known = json_fields(
        controller.status(),
        *("state", "remote", "ready", "running", "paused", "fault", "serious_fault"),
        *("emergency_stop", "guard_open", "warning", "teach", "test", "code"),
    )
    return {"controller": controller.identity, **known, **controller.condition()}


def offset_difference(before: "ToolOffset", after: "ToolOffset") -> dict[str, float]:
    """Return the change of each component of an offset, angles by the shorter way."""
    pairs = zip(COMPONENTS, after.components(), before.components(), strict=True)
    return {
        name: angle_difference_deg(new, old) if name.endswith("_deg") else new - old
        for name, new, old in pairs
    }


def number(value: object) -> str:
    """Return a table cell for a length or an angle."""
    return f"{value:.3f}" if isinstance(value, (int, float)) else "-"


def offset_cells(offset: Mapping[str, object] | None) -> list[str]:
    """Return six table cells for an offset payload."""
    return [number(offset[name]) if offset else "-" for name in COMPONENTS]


AXES = ("X mm", "Y mm", "Z mm", "U deg", "V deg", "W deg")


_SAID = ("controller", "state", "code", "text")


def show_status(payload: Mapping[str, object]) -> None:
    """Print the state in words, then the flags that are on, then what else is known."""
    say(f"{payload['controller']}: {state_word(payload['state'])}")
    if payload["code"]:
        text = payload.get("text", "")
        say(tr("  code {code:04d} {text}", code=payload["code"], text=text).rstrip())
    _show_flags(payload)
    if "power" in payload:
        _show_epson(payload)
        return
    for key in [name for name in payload if name not in _SAID]:
        if payload[key] not in (None, "") and not isinstance(payload[key], bool):
            say(f"  {state_word(key)}: {payload[key]}")


def show_seen(payload: Mapping[str, object], named: str) -> None:
    """Print the last reading by the process that has the controller, and its age.

    Args:
        payload: The document of it.
        named: How the person names the controller.
    """
    say(tr("{holder} has locked this controller.", holder=payload["held_by"]))
    age_s = payload["age_s"]
    if not isinstance(age_s, float):
        say(tr("No state has been read yet."))
        return
    say(
        tr(
            "{controller}, {age:.1f} s ago: {state}",
            controller=payload["controller"],
            age=age_s,
            state=state_word(payload["state"]),
        )
    )
    _show_flags(payload)
    say(tr('To stop it: robolink -c "{url}" stop', url=named))


def _show_flags(payload: Mapping[str, object]) -> None:
    on = [key for key, value in payload.items() if value is True and key != "motors_on"]
    say(tr("  flags: {flags}", flags=", ".join(map(state_word, on)) or tr("none")))


def _show_epson(payload: Mapping[str, object]) -> None:
    alarms = payload["alarms"]
    if isinstance(alarms, Sequence) and alarms:
        say(tr("  alarms: {numbers}", numbers=", ".join(str(number) for number in alarms)))
    _show_preferences(payload["preferences"])
    if payload["selected_tool"] is not None:
        say(
            tr(
                "  tool {tool} selected; motors {motors}, {power}",
                tool=payload["selected_tool"],
                motors=tr("on") if payload["motors_on"] else tr("off"),
                power=power_words(payload["power"]),
            )
        )
    elif payload["published_selected_tool"] is not None:
        say(tr("  selected tool, as published: {tool}", tool=payload["published_selected_tool"]))
    if missing := _unread(payload):
        say(tr("  not read: {what}", what=", ".join(missing)))


def _unread(payload: Mapping[str, object]) -> list[str]:
    """Return what the controller, or its line, does not report in its present state."""
    known = dict(payload)
    if known["selected_tool"] is None:
        known["selected_tool"] = known["published_selected_tool"]
    words = {
        "alarms": tr("alarms"),
        "preferences": tr("preferences"),
        "selected_tool": tr("selected tool"),
        "motors_on": tr("motors"),
        "power": tr("power"),
    }
    return [word for name, word in words.items() if known[name] is None]


def _show_preferences(told: object) -> None:
    """Warn of what makes the cell unreal, and name what switches outputs off."""
    if not isinstance(told, Mapping):
        return  # older firmware does not report it, and nothing is assumed
    if told["dry_run"]:
        say(tr("  DRY RUN is set: the robot does not move. Nothing can be measured."))
    if told["virtual_io"]:
        say(tr("  VIRTUAL I/O is set: no input is real. Nothing can be measured."))
    causes = {"reset_outputs_off": tr("reset"), "outputs_off_at_estop": tr("emergency stop")}
    if named := [cause for name, cause in causes.items() if told[name]]:
        say(tr("  outputs go off at: {causes}", causes=", ".join(named)))


def show_pose(payload: Mapping[str, object]) -> None:
    """Print a pose and the joints, as far as this kind of controller has them."""
    if payload["tool"] is None:
        title = tr("this controller does not report the tool")
    elif payload["hand"] is None:
        title = tr("tool {tool}", tool=payload["tool"])
    else:
        hand = hand_words(payload["hand"])
        title = tr(
            "tool {tool} in local {local}, {hand}",
            tool=payload["tool"],
            local=payload["local"],
            hand=hand,
        )
    table(title, AXES, [offset_cells(payload)])
    joints, axes = payload.get("joints"), payload.get("axes")
    if isinstance(joints, Sequence):
        say(tr("  joints: {joints}", joints="  ".join(number(j) for j in joints)))
    if isinstance(axes, Sequence):
        say(tr("  axes: {axes}", axes="  ".join(number(axis) for axis in axes)))


def show_tools(tools: Mapping[str, Mapping[str, object] | None], selected: int | None) -> None:
    """Print the defined tools; the selected one is marked."""
    rows = []
    for tool, offset in tools.items():
        if offset is not None:
            mark = "*" if int(tool) == selected else " "
            rows.append([f"{mark}{tool}", *offset_cells(offset)])
    if rows:
        table(tr("tools (* selected)"), (tr("tool"), *AXES), rows)
    odd = [tool for tool, offset in tools.items() if offset is not None and _of_no_tool(offset)]
    if odd:
        say(tr("  values that are no tool: {tools}", tools=", ".join(odd)))
    missing = [tool for tool, offset in tools.items() if offset is None]
    if missing:
        say(tr("  undefined: {tools}", tools=", ".join(missing)))


def _of_no_tool(offset: Mapping[str, object]) -> bool:
    """Return whether a number in a document's offset is one that no tool has."""
    return of_no_tool([float(str(value)) for value in offset.values()])


def show_offset(title: str, offset: Mapping[str, object] | None) -> None:
    """Print one offset under a title."""
    if offset is None:
        say(tr("{title}: there is none now", title=title))
    else:
        table(title, AXES, [offset_cells(offset)])


def show_change(
    tool: int,
    before: ToolOffset | None,
    after: ToolOffset | None,
    *,
    after_name: str,
    unmeasured: Sequence[str] = (),
) -> None:
    """Print an offset before and after, and which components were not measured."""
    rows = [[tr("before"), *_cells(before)], [after_name, *_cells(after)]]
    if before is not None and after is not None:
        rows.append([tr("change"), *map(number, offset_difference(before, after).values())])
    table(tr("tool {tool}", tool=tool), ("", *AXES), rows)
    for name in unmeasured:
        if after is not None and name[0] in "xyzu":
            say(
                tr(
                    "  {axis} {value}: not measured, stays.",
                    axis=name[0].upper(),
                    value=number(getattr(after, name)),
                )
            )


def _cells(offset: ToolOffset | None) -> list[str]:
    return ["-"] * len(COMPONENTS) if offset is None else [*map(number, offset.components())]
