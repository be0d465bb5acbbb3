"""Tables for people."""

from collections.abc import Mapping, Sequence

from robolink.messages import tr
from robolink.model import COMPONENTS, ToolOffset, of_no_tool
from robolink_cli.console.render import say, table
from robolink_cli.console.ways import hand_words, power_words, state_word
from robolink_cli.views.documents import number, offset_cells, offset_difference

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
    """Print what the process that has the controller saw of it last, and how old that is.

    Args:
        payload: The document of it.
        named: How the person names the controller.
    """
    say(tr("{holder} has this controller.", holder=payload["held_by"]))
    age_s = payload["age_s"]
    if not isinstance(age_s, float):
        say(tr("It has not read the state yet."))
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
    """Return what the controller, or its line, did not tell in its present state."""
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
        return  # older firmware does not tell, and nothing is assumed
    if told["dry_run"]:
        say(tr("  DRY RUN is set: the robot does not move. Nothing can be measured."))
    if told["virtual_io"]:
        say(tr("  VIRTUAL I/O is set: no input is real. Nothing can be measured."))
    causes = {"reset_outputs_off": tr("reset"), "outputs_off_at_estop": tr("emergency stop")}
    if named := [cause for name, cause in causes.items() if told[name]]:
        say(tr("  outputs go off at: {causes}", causes=", ".join(named)))


def show_pose(payload: Mapping[str, object]) -> None:
    """Print a pose and the joints; what this kind of controller has not is not spoken of."""
    if payload["tool"] is None:
        title = tr("tool not told by this controller")
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
    """Print the defined tools; the one in force is marked."""
    rows = []
    for tool, offset in tools.items():
        if offset is not None:
            mark = "*" if int(tool) == selected else " "
            rows.append([f"{mark}{tool}", *offset_cells(offset)])
    if rows:
        table(tr("tools (* selected)"), (tr("tool"), *AXES), rows)
    odd = [tool for tool, offset in tools.items() if offset is not None and _of_no_tool(offset)]
    if odd:
        say(tr("  holding the values of no tool: {tools}", tools=", ".join(odd)))
    missing = [tool for tool, offset in tools.items() if offset is None]
    if missing:
        say(tr("  undefined: {tools}", tools=", ".join(missing)))


def _of_no_tool(offset: Mapping[str, object]) -> bool:
    """Whether a number in a document's offset is one that no tool has."""
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
