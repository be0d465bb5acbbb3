"""station learn: find a station with a known tip, show it, keep it."""

from dataclasses import replace
from pathlib import Path

from robolink.calibration_run import (
    Limits,
    flange_now,
    foresee,
    height_is_known,
    require_contact_input,
    require_inside,
    tip_sigma_mm,
    touching_as_recorded,
)
from robolink.errors import ConfigError, DeclinedError, UndefinedToolError
from robolink.messages import tr
from robolink.methods import learn_station
from robolink.model import Controller, EntryKind, ToolOffset
from robolink.procedures import MeasurementContext, TouchPlan
from robolink.runner import ArmAhead, inputs_of
from robolink.stations import (
    Found,
    Station,
    StationKind,
    base_now,
    find_stations,
    learnt_elsewhere,
    require_base_of,
    station_entry,
)
from robolink_cli.console.render import emit, note, table
from robolink_cli.prompts.operator import operator_at
from robolink_cli.session.connection import open_controller
from robolink_cli.session.context import CliContext
from robolink_cli.session.motion_consent import agree_to_motion, motion_question
from robolink_cli.views.documents import number
from robolink_cli.views.fit import show_plan, steps_payload
from robolink_cli.views.stations import known_stations, station_payload


def learn(
    context: CliContext,
    name: str,
    *,
    tool: int,
    limits: Limits,
    sigma_mm: float | None,
    touch: TouchPlan,
    assist: str | None,
    picture: Path | None,
    dry_run: bool,
    yes: bool,
) -> None:
    """Measure a station, ask, and record it. Writes no tool.

    Args:
        context: The command.
        name: The station's name.
        tool: The tool whose tip is known.
        limits: How far and how fast the robot may move.
        sigma_mm: Standard deviation of one coordinate of one touch, ``None`` where unknown.
        touch: How a pin is touched.
        assist: A simulator's person in place of a real one.
        picture: Where the picture of a camera is written; ``None`` for a name of its own.
        dry_run: Whether nothing is done.
        yes: Whether questions are answered in advance.

    Raises:
        CalibrationError: The measurement is not trusted.
        ConfigError: The station is not declared, and it is no pin.
        DeclinedError: A person said no, or nobody could be asked.
        UndefinedToolError: The tool has no offset.
    """
    camera = _camera(context, name)
    if camera is not None:
        from robolink_cli.commands.measure.camera_learning import LearnRequest, learn_camera

        if sigma_mm is not None or touch.contact is not None:
            raise ConfigError(
                tr("--sigma and --contact-input are for pins; {name} is a camera.", name=name),
                remedy=tr("Leave them out."),
            )
        learn_camera(context, camera, LearnRequest(tool, limits, picture, assist, dry_run, yes))
        return
    if picture is not None:
        raise ConfigError(
            tr("--picture is for cameras; {name} is none.", name=name),
            remedy=tr("Leave it out."),
        )
    job = "" if dry_run else tr("learn station {name}", name=name)
    there = context._replace(station=name)
    with open_controller(there, changes=not dry_run, job=job) as controller:
        known = _known(context, controller, name)
        tip = _tip(controller, tool)
        if touch.contact is not None:
            inputs_of(controller)
        touch = touching_as_recorded(controller, touch, name)
        here = flange_now(controller)
        course = learn_station(
            known, here=here, tool=tool, tip=tip, plan=replace(touch, nominal=True)
        )
        ahead = ArmAhead.of(controller)
        steps = foresee(course, here=here, settings=limits.settings(here, None), arm=ahead)
        if dry_run:
            payload = {"dry_run": True, "tool": tool, "steps": steps_payload(controller, steps)}
            emit("dry-run", payload, lambda: show_plan(payload))
            return
        require_inside(controller, steps)
        require_contact_input(controller, touch)
        purpose = tr("to find station {name} with tool {tool}", name=name, tool=tool)
        question = motion_question(
            controller, purpose, speed_mm_s=limits.speed_mm_s, box_mm=limits.box.x_max_mm
        )
        agree_to_motion(question, yes=yes)
        with (
            operator_at(assist, lambda: tool, controller.clock) as operator,
            controller.preserved(purpose),
        ):
            controller.tools.select(0)
            start = controller.groups[0].pose()
            bench = MeasurementContext(controller, operator, start=start, settings=limits.settings)
            found = bench.run(
                learn_station(
                    known,
                    here=start,
                    tool=tool,
                    tip=tip,
                    sigma_mm=sigma_mm,
                    tip_sigma_mm=tip_sigma_mm(controller, tool),
                    plan=touch,
                )
            )
            found = _height_of_pin(controller, known, found, tool)
            _show(known, found)
            if not yes and not bench.runner().confirm(tr("Record this?")):
                raise DeclinedError(
                    tr("You did not accept the place."), remedy=tr("Nothing was recorded.")
                )
            controller.outcomes.append(station_entry(found, base=base_now(controller)))
        kept = _known(context, controller, name)
    emit("station", station_payload(kept), lambda: None)


def _height_of_pin(controller: Controller, known: Station, found: Found, tool: int) -> Found:
    """Return the findings, with a pin's height only if Z of the tool is more than a kept value."""
    if found.kind is not StationKind.PIN or height_is_known(controller, tool):
        return found
    note(
        tr(
            "Z of tool {tool} was never measured: robolink does not learn the height of "
            "{station} from it.",
            tool=tool,
            station=found.id,
        )
    )
    z_from = known.details.get("z_from", "")
    return replace(found, z_mm=known.z_mm, details={**found.details, "z_from": z_from})


def _camera(context: CliContext, name: str) -> Station | None:
    """Return a station that is a camera, as cell file and journal know it; ``None`` for others."""
    for known in known_stations(context):
        if known.station.id == name and known.station.kind is StationKind.CAMERA:
            return known.station
    return None


def _known(context: CliContext, controller: Controller, name: str) -> Station:
    entries = controller.outcomes.recorded(kinds=(EntryKind.STATION,))
    # A pin needs only its name: the person finds it.
    unknown = Station(id=name, kind=StationKind.PIN)
    known = find_stations(context.cell, entries).get(name) or unknown
    if learnt_elsewhere(controller, known) is None:
        return known
    declared = find_stations(context.cell, ()).get(name)
    if declared is None and known.kind is not StationKind.PIN:
        require_base_of(controller, known)
    note(
        tr(
            "The record of station {id} was learnt in another base (Base) and is not used.",
            id=name,
        )
    )
    return declared or unknown


def _tip(controller: Controller, tool: int) -> ToolOffset:
    offset = controller.tools.read(tool)
    if offset is None:
        raise UndefinedToolError(
            tr("Tool {tool} is not defined, so it cannot be used to learn a station.", tool=tool),
            remedy=tr("Use a tool with an accurately known offset, such as a gauge pin."),
            controller=controller.identity,
        )
    if offset.v_deg or offset.w_deg:
        raise ConfigError(
            tr("Tool {tool} is tilted (V or W is not 0).", tool=tool),
            remedy=tr("Use an upright tool."),
        )
    return offset


def _show(known: Station, found: Found) -> None:
    columns = ("", "X mm", "Y mm", "Z mm")
    before = [number(known.x_mm), number(known.y_mm), number(known.z_mm)]
    after = [number(found.x_mm), number(found.y_mm), number(found.z_mm)]
    rows = [[tr("before"), *before], [tr("after"), *after]]
    table(tr("station {id}", id=found.id), columns, rows)
    for line in _lines(found):
        note(
            tr(
                "  beam on input {input}: X {x:.3f} Y {y:.3f}, direction {direction:.3f} deg",
                input=line["input"],
                x=line["x_mm"],
                y=line["y_mm"],
                direction=line["direction_deg"],
            )
        )


def _lines(found: Found) -> list[dict[str, float]]:
    lines = found.details.get("beams", [])
    return lines if isinstance(lines, list) else []
