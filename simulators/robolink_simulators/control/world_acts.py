"""Acts on the world around any robot: see it, equip it, disturb it, touch it."""

from collections.abc import Iterator, Mapping
from dataclasses import asdict, replace
from typing import Any, Final, Literal, get_args, get_origin, get_type_hints

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink_simulators.cell.habits import PersonManner
from robolink_simulators.cell.person import PersonLook
from robolink_simulators.cell.tip_switches import LightBeam, TouchPlate
from robolink_simulators.cell.world_parameters import (
    LIMITS,
    WorldParameters,
    parameter_names,
    parameters_from_text,
)
from robolink_simulators.control.answers import (
    FlangeTold,
    MarksSeen,
    TipTold,
    WaySeen,
    WorldTold,
)
from robolink_simulators.control.cell import ControlledCell
from robolink_simulators.control.declared_acts import (
    NUMBER,
    WHOLE_TOOL,
    Answer,
    ControlAct,
    Form,
    Given,
    Taken,
    shown_flange,
)
from robolink_simulators.epson.world import World
from robolink_simulators.option_values import MOST_OF_AN_OPTION
from robolink_simulators.plc import PlcSimulator
from robolink_simulators.softmotion.world import SoftMotionWorld

_LIMITS: Final = {
    "camera_um_per_px_x": (1e-6, MOST_OF_AN_OPTION),
    "camera_um_per_px_y": (1e-6, MOST_OF_AN_OPTION),
    "person_stays_share": (0, 1),
    "camera_still_share": (0, 1),
    **LIMITS,
}
"""Lowest and highest value of the world parameters for which not every number from 0 is allowed."""

_FORMS: Final[Mapping[Any, tuple[Form, bool]]] = {
    float: ("number", False),
    int: ("whole", False),
    int | None: ("whole", True),
}
"""The form of a parameter by its type, and whether null is one."""

_SCATTER: Final = Taken("noise_mm", needed=False, least=0)


def world_of(cell: ControlledCell) -> World | SoftMotionWorld:
    """Return the world of a cell.

    Raises:
        ConfigError: Its simulator has none.
    """
    if isinstance(cell.simulator, PlcSimulator):
        raise ConfigError(
            tr("A PLC with a register map has no simulated world."),
            remedy=tr("Simulate an EPSON or a SoftMotion controller for that."),
        )
    return cell.simulator.world


def _look(cell: ControlledCell, given: Given) -> Answer:
    """Look from the tip to the pin, with the eye's error; a vector in base axes."""
    return asdict(world_of(cell).operator.look(given.get("tool")))


def _jog_onto_pin(cell: ControlledCell, given: Given) -> Answer:
    """Jog the tip onto the pin by hand (on an EPSON in Teach mode), and return the flange there."""
    flange = world_of(cell).operator.jog_onto_pin(given.get("tool"))
    return {"flange": shown_flange(flange)}


def _change_nozzle(cell: ControlledCell, given: Given) -> Answer:
    """Mount another nozzle; its tip is some tenths of a millimetre from the old one's."""
    world, tool = world_of(cell), given.get("tool")
    return {"tip": asdict(world.change_nozzle() if tool is None else world.change_nozzle(tool))}


def _see(cell: ControlledCell, given: Given) -> Answer:
    """Take a picture with the up-looking camera, and return the pixels that look like a mark."""
    spots = world_of(cell).spots(given.get("mark", 0))
    return {
        "seen": [[x, y] for x, y, _ in spots],
        "radii_px": [radius_px for _, _, radius_px in spots if radius_px is not None],
    }


def _be_asked(cell: ControlledCell, given: Given) -> Answer:
    """Ask the person something, and return how the person handles it."""
    operator = world_of(cell).operator
    asked = given.get("touch", False)
    return asdict(operator.begin_touch(given.get("tool")) if asked else operator.be_asked())


def _way_along(cell: ControlledCell, given: Given) -> Answer:
    """Return the vector, in base axes, that the person sees along an axis of a tool."""
    operator = world_of(cell).operator
    way_mm = operator.way_along(given["axis"], given["length_mm"], given.get("tool"))
    return {"way_mm": list(way_mm)}


def _set_world(cell: ControlledCell, given: Given) -> Answer:
    """Give the cell other imperfections, and return all of them."""
    world = world_of(cell)
    asked = {
        name: str(int(value)) if isinstance(value, bool) else str(value)
        for name, value in given.items()
    }
    world.set_up(replace(world.parameters, **parameters_from_text(asked)))  # type: ignore[arg-type]
    return {"parameters": asdict(world.parameters)}


def _mount_beam(cell: ControlledCell, given: Given) -> Answer:
    """Mount a light beam that switches an input when the nozzle meets it."""
    place = (given["x_mm"], given["y_mm"], given["z_mm"])
    names = ("nozzle_radius_mm", "radius_mm", "tilt_deg")
    shape = {name: given[name] for name in names if name in given}
    beam = LightBeam(place, given["heading_deg"], **shape)
    world_of(cell).connect(given["number"], beam, noise_mm=given.get("noise_mm", 0.0))
    return {}


def _mount_plate(cell: ControlledCell, given: Given) -> Answer:
    """Mount a plate that switches an input when the nozzle touches it."""
    plate = TouchPlate(given["z_mm"])
    world_of(cell).connect(given["number"], plate, noise_mm=given.get("noise_mm", 0.0))
    return {}


class _AnyOfTheWorld(ControlAct):
    """Takes the parameters of the world by their names."""

    __slots__ = ()

    def checked(self, given: Given) -> dict[str, object]:
        """Check values; the world itself refuses unknown names."""
        known = {taken.name for taken in self.takes}
        unknown = {name: value for name, value in given.items() if name not in known}
        checked = super().checked({name: value for name, value in given.items() if name in known})
        return unknown | checked


def _parameters() -> Iterator[Taken]:
    """Yield each parameter of the world, with its limits."""
    hints = get_type_hints(WorldParameters)
    for name in parameter_names():
        choices = get_args(hints[name]) if get_origin(hints[name]) is Literal else ()
        if choices:
            yield Taken(name, "text", needed=False, choices=choices)
        elif hints[name] is bool:
            yield Taken(name, "flag", needed=False)
        else:
            least, most = _LIMITS.get(name, (0, MOST_OF_AN_OPTION))
            form, or_none = _FORMS[hints[name]]
            yield Taken(name, form, needed=False, least=least, most=most, or_none=or_none)


_PLACE: Final = tuple(Taken(name) for name in ("x_mm", "y_mm", "z_mm"))
_SHAPE: Final = tuple(
    Taken(name, needed=False) for name in ("nozzle_radius_mm", "radius_mm", "tilt_deg")
)

WORLD_ACTS: Final = (
    ControlAct("look", _look, (WHOLE_TOOL,), reads=True, gives=PersonLook),
    ControlAct("see", _see, (Taken("mark", "whole", needed=False),), reads=True, gives=MarksSeen),
    ControlAct(
        "be_asked",
        _be_asked,
        (Taken("touch", "flag", needed=False), WHOLE_TOOL),
        gives=PersonManner,
    ),
    ControlAct(
        "way_along",
        _way_along,
        (Taken("axis", "text", choices=("x", "z")), Taken("length_mm"), WHOLE_TOOL),
        reads=True,
        gives=WaySeen,
    ),
    ControlAct("jog_onto_pin", _jog_onto_pin, (WHOLE_TOOL,), gives=FlangeTold),
    ControlAct("change_nozzle", _change_nozzle, (WHOLE_TOOL,), gives=TipTold),
    _AnyOfTheWorld(
        "set_world",
        _set_world,
        tuple(_parameters()),
        gives=WorldTold,
    ),
    ControlAct(
        "mount_beam", _mount_beam, (NUMBER, *_PLACE, Taken("heading_deg"), *_SHAPE, _SCATTER)
    ),
    ControlAct("mount_plate", _mount_plate, (NUMBER, Taken("z_mm"), _SCATTER)),
)
"""Acts on the world."""
