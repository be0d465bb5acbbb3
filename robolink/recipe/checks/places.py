"""Whether tools, points, poses and the box of a recipe fit each other."""

from collections.abc import Iterator
from itertools import combinations

from robolink.files.toml import Problem
from robolink.messages import tr
from robolink.methods import PointsParameters
from robolink.recipe.checks.draft import Draft
from robolink.recipe.file.tables import Box, FlangePose, Tool


def tool_numbers(draft: Draft) -> Iterator[Problem]:
    """Check that no tool stands there twice."""
    seen: set[int] = set()
    for place, tool in _tools(draft):
        if tool.number in seen:
            yield Problem(f"{place}.number", tr("is given twice; write each tool once"))
        seen.add(tool.number)


def points(draft: Draft) -> Iterator[Problem]:
    """Check that each tool has the points that the method needs, and nobody else's."""
    source = draft.source
    if source is None:
        return
    parameters, owners = source.parameters, dict[int, int]()
    for place, tool in _tools(draft):
        where = f"{place}.points"
        if not isinstance(parameters, PointsParameters):
            if tool.points is not None:
                yield Problem(where, tr('means nothing without kind = "points" in [source]'))
            if tool.poses is not None:
                yield Problem(
                    f"{place}.poses", tr('means nothing without kind = "points" in [source]')
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
    """Check that nothing says how to move where nothing moves."""
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
            "verify", tr('cannot be true: nothing moves with kind = "points", so nothing is proved')
        )
    if draft.refusal is not None and draft.refusal.action == "measure_again":
        yield Problem(
            "refusal.action",
            tr('cannot be "measure_again": the same points would be refused again; write "stop"'),
        )


def upright(draft: Draft) -> Iterator[Problem]:
    """Check that the flange is tilted only where the measurement can bear it."""
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
