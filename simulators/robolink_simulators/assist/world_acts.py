"""What every assist port can do with the world around the robot: see it, furnish it, spoil it."""

from collections.abc import Callable, Mapping
from dataclasses import asdict, replace
from typing import Final

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink_simulators.assist.parameters import (
    Answer,
    Parameters,
    number_in,
    tool_number,
    whole_number,
)
from robolink_simulators.cell.places import Axis
from robolink_simulators.cell.tip_switches import LightBeam, TouchPlate
from robolink_simulators.cell.world_parameters import parameters_from_text
from robolink_simulators.epson.world import World
from robolink_simulators.softmotion.world import SoftMotionWorld

Furnished = World | SoftMotionWorld

Act = Callable[[Furnished, Parameters], Answer]


def _see(world: Furnished, request: Parameters) -> Answer:
    mark = whole_number(request, "mark") if "mark" in request else 0
    return {"seen": [list(pixel) for pixel in world.see(mark)]}


def _be_asked(world: Furnished, request: Parameters) -> Answer:
    operator = world.operator
    touch = bool(request.get("touch", False))
    return asdict(operator.begin_touch(tool_number(request)) if touch else operator.be_asked())


def _way_along(world: Furnished, request: Parameters) -> Answer:
    axis: Axis
    match request.get("axis"):
        case "x" | "z" as named:
            axis = named
        case other:
            raise ConfigError(
                tr("A tool has no axis {axis!r} that is shown.", axis=other),
                remedy=tr("Give it as {example}.", example='"axis": "x"'),
            )
    length_mm = number_in(request, "length_mm")
    return {"way_mm": list(world.operator.way_along(axis, length_mm, tool_number(request)))}


def _set_world(world: Furnished, request: Parameters) -> Answer:
    asked = {name: _as_text(value) for name, value in request.items() if name != "do"}
    world.set_up(replace(world.parameters, **parameters_from_text(asked)))  # type: ignore[arg-type]
    return {"parameters": asdict(world.parameters)}


def _mount_beam(world: Furnished, request: Parameters) -> Answer:
    x_mm, y_mm, z_mm = (number_in(request, name) for name in ("x_mm", "y_mm", "z_mm"))
    shape = {
        name: number_in(request, name)
        for name in ("nozzle_radius_mm", "radius_mm", "tilt_deg")
        if name in request
    }
    beam = LightBeam((x_mm, y_mm, z_mm), number_in(request, "heading_deg"), **shape)
    world.connect(whole_number(request, "number"), beam, noise_mm=_scatter(request))
    return {}


def _mount_plate(world: Furnished, request: Parameters) -> Answer:
    plate = TouchPlate(number_in(request, "z_mm"))
    world.connect(whole_number(request, "number"), plate, noise_mm=_scatter(request))
    return {}


def _scatter(request: Parameters) -> float:
    noise_mm = number_in(request, "noise_mm") if "noise_mm" in request else 0.0
    if noise_mm < 0:
        raise ConfigError(
            tr("A scatter cannot be negative."), remedy=tr("Give noise_mm from 0 up.")
        )
    return noise_mm


def _as_text(value: object) -> str:
    return str(int(value)) if isinstance(value, bool) else str(value)


WORLD_ACTS: Final[Mapping[str, Act]] = {
    "see": _see,
    "be_asked": _be_asked,
    "way_along": _way_along,
    "set_world": _set_world,
    "mount_beam": _mount_beam,
    "mount_plate": _mount_plate,
}
"""Every act by name."""
