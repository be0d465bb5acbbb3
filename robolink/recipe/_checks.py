"""Errors in a recipe that only two of its keys together show."""

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, fields
from itertools import combinations
from typing import Any, Final

from robolink.files.toml import Problem
from robolink.messages import spoken, tr
from robolink.methods import (
    NOTHING_STATED,
    Check,
    PointsParameters,
    StatedLimits,
    order_of_residuals,
    parameter_problems,
)
from robolink.recipe._recipe import Basis, HeightRule
from robolink.recipe._tables import (
    Box,
    FlangePose,
    MethodTable,
    Output,
    Poses,
    Prompt,
    RefusalTable,
    StationTable,
    Tolerances,
    Tool,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Draft:
    """The correct parts of a recipe; ``None`` for the rest, which is already reported.

    Attributes:
        given: The keys at the top of the file, right or wrong.
    """

    given: Collection[str]
    basis: Basis | None = None
    z: HeightRule | None = None
    verify: bool | None = None
    source: MethodTable | None = None
    station: StationTable | None = None
    poses: Poses | None = None
    tools: tuple[Tool, ...] | None = None
    box: Box | None = None
    tolerances: Tolerances | None = None
    refusal: RefusalTable | None = None
    prompts: tuple[Prompt, ...] | None = None
    outputs: tuple[Output, ...] | None = None

    @classmethod
    def of(cls, sound: Mapping[str, Any], *, given: Collection[str]) -> "Draft":
        """Return the draft of the tables that are right by themselves."""
        names = {field.name for field in fields(cls)}
        return cls(given=given, **{name: sound[name] for name in sound if name in names})


_OF_ONE_TOOL: Final = frozenset({"before_measure", "after_measure"})
_FOR_THE_RECORD: Final = frozenset({"nozzle", "lot"})
_TOO_LATE: Final = frozenset({"before_write", "end"})


def moments(draft: Draft) -> Iterator[Problem]:
    """Check the tools that prompts and outputs name."""
    known = None if draft.tools is None else {tool.number for tool in draft.tools}
    for where, entry in _entries(draft):
        if entry.tool is None:
            continue
        if entry.at not in _OF_ONE_TOOL:
            yield Problem(
                where, tr('has no effect here: "{at}" comes once for all tools', at=entry.at)
            )
        elif known is not None and entry.tool not in known:
            yield Problem(
                where,
                tr("is not a tool of this recipe; write one of its [[tools]], or leave it out"),
            )


def answers(draft: Draft) -> Iterator[Problem]:
    """Check that a nozzle and its lot are asked for once, and before they are recorded."""
    asked: set[tuple[str, int | None]] = set()
    for number, prompt in enumerate(draft.prompts or (), start=1):
        if prompt.answer not in _FOR_THE_RECORD:
            continue
        if prompt.at in _TOO_LATE:
            yield Problem(
                f"prompts#{number}.at",
                tr(
                    "is too late for this answer: the measurement is already recorded by then; "
                    'write "start" or "before_measure"'
                ),
            )
        if asked & {(prompt.answer, prompt.tool), (prompt.answer, None)}:
            yield Problem(f"prompts#{number}.answer", tr("is already asked; ask it once"))
        asked.add((prompt.answer, prompt.tool))


def _entries(draft: Draft) -> Iterator[tuple[str, Prompt | Output]]:
    for number, prompt in enumerate(draft.prompts or (), start=1):
        yield f"prompts#{number}.tool", prompt
    for number, output in enumerate(draft.outputs or (), start=1):
        yield f"outputs#{number}.tool", output


def tool_numbers(draft: Draft) -> Iterator[Problem]:
    """Check that no tool is listed twice."""
    seen: set[int] = set()
    for place, tool in _tools(draft):
        if tool.number in seen:
            yield Problem(f"{place}.number", tr("is given twice; write each tool once"))
        seen.add(tool.number)


def points(draft: Draft) -> Iterator[Problem]:
    """Check that each tool has the points that the method needs, and no others."""
    source = draft.source
    if source is None:
        return
    parameters, owners = source.parameters, dict[int, int]()
    for place, tool in _tools(draft):
        where = f"{place}.points"
        if not isinstance(parameters, PointsParameters):
            if tool.points is not None:
                yield Problem(where, tr('has no effect without kind = "points" in [source]'))
            if tool.poses is not None:
                yield Problem(
                    f"{place}.poses", tr('has no effect without kind = "points" in [source]')
                )
        elif tool.poses is not None:
            if tool.points is not None:
                yield Problem(where, tr("is given as well as poses; give one of the two"))
        elif tool.points is None:
            yield Problem(where, tr("is missing: the numbers of the points that touch the pin"))
        else:
            if why := parameters.wrong_count(len(tool.points)):
                yield Problem(where, why)
            yield from _owned(where, tool, owners)


def _owned(where: str, tool: Tool, owners: dict[int, int]) -> Iterator[Problem]:
    for position, point in enumerate(tool.points or (), start=1):
        if point in owners:
            yield Problem(
                f"{where}#{position}",
                tr("P{point} is a point of tool {tool} already", point=point, tool=owners[point]),
            )
        owners[point] = tool.number


def standstill(draft: Draft) -> Iterator[Problem]:
    """Check that nothing states how to move if nothing moves."""
    if draft.source is None or draft.source.of_method.needs.motion:
        return
    said = [key for key in ("poses", "speeds", "box") if key in draft.given]
    for place, tool in _tools(draft):
        said += [f"{place}.{key}" for key in ("approach", "retreat") if getattr(tool, key)]
    for where in said:
        yield Problem(
            where, tr('says how to move, and nothing moves with kind = "points"; leave it out')
        )
    if draft.verify:
        yield Problem(
            "verify",
            tr('cannot be true: nothing moves with kind = "points", so there is no turn test'),
        )
    if draft.refusal is not None and draft.refusal.action == "measure_again":
        yield Problem(
            "refusal.action",
            tr('cannot be "measure_again": the same points would be refused again; write "stop"'),
        )


def upright(draft: Draft) -> Iterator[Problem]:
    """Check that the flange is tilted only if the measurement allows it."""
    source = draft.source
    if source is None:
        return
    needs = source.of_method.needs
    if needs.tilt or not needs.motion:
        return
    safe = draft.poses.safe if draft.poses else None
    for where, pose in [*_poses(draft), *([("poses.safe", safe)] if safe else [])]:
        for key in ("v_deg", "w_deg"):
            if getattr(pose, key):
                yield Problem(
                    f"{where}.{key}",
                    tr(
                        'must be 0 with kind = "{kind}", which measures upright; "pivot" and '
                        '"six-point" work on a tilted flange',
                        kind=source.kind,
                    ),
                )


def room(draft: Draft) -> Iterator[Problem]:
    """Check that the poses can lie in one box.

    With a safe pose the box lies about it from the second run on, for the first one ended
    there. Without, it must at least be possible to start where all poses are inside.
    """
    box, poses = draft.box, draft.poses
    if box is None or poses is None:
        return
    targets = list(_poses(draft))
    if poses.safe is None:
        yield from _together(box, [pose for _, pose in targets])
        return
    inside = box.reach.about(poses.safe.pose)
    for where, pose in targets:
        if not inside.holds(pose.pose):
            yield Problem(
                where,
                tr(
                    "is outside the box around the safe pose, where a run ends and the next "
                    "one starts; move it, or make [box] larger"
                ),
            )


def turning_back(draft: Draft) -> Iterator[Problem]:
    """Check that there is a pose to which U could turn back."""
    poses = draft.poses
    if poses is not None and poses.safe is None and "turn_back" in poses.model_fields_set:
        yield Problem("poses.turn_back", tr("has no effect without safe"))


def _together(box: Box, poses: list[FlangePose]) -> Iterator[Problem]:
    wide = any(
        abs(a.x_mm - b.x_mm) > 2 * box.sideways_mm or abs(a.y_mm - b.y_mm) > 2 * box.sideways_mm
        for a, b in combinations(poses, 2)
    )
    tall = any(abs(a.z_mm - b.z_mm) > box.down_mm + box.up_mm for a, b in combinations(poses, 2))
    if wide or tall:
        yield Problem(
            "box", tr("is too small: wherever the robot starts, some pose of a tool is outside")
        )


def _poses(draft: Draft) -> Iterator[tuple[str, FlangePose]]:
    """Yield the poses of the tools, each with its path."""
    for place, tool in _tools(draft):
        for key, pose in (("approach", tool.approach), ("retreat", tool.retreat)):
            if pose is not None:
                yield f"{place}.{key}", pose


def _tools(draft: Draft) -> list[tuple[str, Tool]]:
    return [(f"tools#{number}", tool) for number, tool in enumerate(draft.tools or (), start=1)]


_LIMITS: Final = tuple(field.name for field in fields(StatedLimits))
"""Keys of ``[tolerances]``; the other limits are keys of ``[source]``."""


def parameters(draft: Draft) -> Iterator[Problem]:
    """Check what the method says about its parameters and limits, in the words of the command."""
    source, box = draft.source, draft.box
    if source is None:
        yield from map(_placed, order_of_residuals(_stated(draft) or NOTHING_STATED))
        return
    check = Check(
        given=source.model_fields_set,
        limits=_stated(draft),
        box_height_mm=None if box is None else box.reach.height_mm,
        poses_exist=not source.of_method.needs.motion,
        spell=lambda name: "tolerances.sigma_mm" if name == "sigma_mm" else name,
    )
    yield from map(_placed, parameter_problems(source.of_method, source.parameters, check))


def _stated(draft: Draft) -> StatedLimits | None:
    """Return the stated limits, ``None`` if that cannot be told."""
    table = draft.tolerances
    if table is None:
        return None if "tolerances" in draft.given else NOTHING_STATED
    return StatedLimits(**{name: getattr(table, name) for name in _LIMITS})


def _placed(problem: Problem) -> Problem:
    """Return a problem under its place in the recipe."""
    table = "tolerances" if problem.where in _LIMITS else "source"
    return Problem(f"{table}.{problem.where}", problem.what)


def place(draft: Draft) -> Iterator[Problem]:
    """Check that the station states its place, if the method goes there."""
    station, source = draft.station, draft.source
    if station is None or source is None or source.of_method.needs.place is None:
        return
    if station.x_mm is None and station.y_mm is None and station.z_mm is None:
        return  # all of the place comes from the station's record
    where, height = source.of_method.needs.place
    if station.x_mm is None and station.y_mm is None:
        yield Problem("station.x_mm", _missing(source.kind, where))
    if station.z_mm is None:
        yield Problem("station.z_mm", _missing(source.kind, height))


def _missing(kind: str, what: str) -> str:
    return tr('is missing: with kind = "{kind}" it is {what}', kind=kind, what=spoken(what))


def both_coordinates(draft: Draft) -> Iterator[Problem]:
    """Check that the place of the station is whole."""
    station = draft.station
    if station is not None and (station.x_mm is None) != (station.y_mm is None):
        absent = "x_mm" if station.x_mm is None else "y_mm"
        yield Problem(f"station.{absent}", tr("is missing: give x_mm and y_mm, or neither"))


def height(draft: Draft) -> Iterator[Problem]:
    """Check that Z can be measured, if it is to be."""
    if draft.source is None or draft.z is None:
        return
    method = draft.source.of_method
    if draft.z != "measured" and method.only_z:
        yield Problem("z", tr('must be "measured": a touch measures only Z'))
    if draft.z == "measured" and method.unmeasured_z:
        yield Problem("z", spoken(method.unmeasured_z))


def orientation(draft: Draft) -> Iterator[Problem]:
    """Check that a measured orientation is not compared with a reference."""
    if draft.source is None or draft.basis != "difference":
        return
    if "v_deg" in draft.source.of_method.measures:
        yield Problem(
            "basis", tr('must be "absolute": a whole orientation is written as it was measured')
        )


def verification(draft: Draft) -> Iterator[Problem]:
    """Check that a drift is judged only if one is measured."""
    limits, source = draft.tolerances, draft.source
    if limits is None or source is None or "drift_mm" not in limits.model_fields_set:
        return
    if draft.verify is False or not source.of_method.needs.motion:
        yield Problem("tolerances.drift_mm", tr("has no effect: no drift is measured"))


def refusals(draft: Draft) -> Iterator[Problem]:
    """Check that attempts are allowed if the measurement is repeated."""
    refusal = draft.refusal
    if refusal is not None and refusal.action == "stop" and refusal.attempts is not None:
        yield Problem("refusal.attempts", tr('has no effect without action = "measure_again"'))


_CHECKS: Final[tuple[Callable[[Draft], Iterator[Problem]], ...]] = (
    parameters,
    place,
    both_coordinates,
    height,
    orientation,
    tool_numbers,
    points,
    standstill,
    upright,
    room,
    turning_back,
    verification,
    refusals,
    moments,
    answers,
)


def problems_together(draft: Draft) -> tuple[Problem, ...]:
    """Return all errors between tables that are right by themselves."""
    return tuple(problem for check in _CHECKS for problem in check(draft))
