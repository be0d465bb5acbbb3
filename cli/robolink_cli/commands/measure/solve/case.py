"""The content of a case: every value knows its path, and unknown names are refused."""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from inspect import Parameter, Signature, signature
from typing import Any, Final, Literal, TypeVar, cast, get_args, get_origin

from robolink import calibration as cal
from robolink.errors import CalibrationError, ConfigError
from robolink.messages import known_names, tr
from robolink.model import Hand, Pose, ToolOffset, WorkBox

EULER: Final = "R=Rz(U)Ry(V)Rx(W)"

Payload = dict[str, object]
"""The answer to a case: plain values by their names in the shared cases."""

T = TypeVar("T")

_HUGE: Final = 1e12
"""Limit above every length or angle in a cell. Squares of smaller values are finite."""

_UNIT_WITHIN: Final = 0.01

_FRAMES: Final = ("tools", "locals")


@dataclass(frozen=True, slots=True)
class KnownFrames:
    """Values of the tools and locals in which poses of a case may have been taken.

    Attributes:
        tools: Offsets by number.
        local_frames: Where locals lie in the base, by number.
    """

    tools: Mapping[int, ToolOffset] = field(default_factory=dict)
    local_frames: Mapping[int, ToolOffset] = field(default_factory=dict)

    def flange(self, pose: Pose) -> Pose:
        """Return a pose as one of the flange in the base, as far as the values are known."""
        if not (self.tools or self.local_frames):
            return pose
        return cal.flange_poses([pose], tools=self.tools, local_frames=self.local_frames)[0]


class Node:
    """An object of the file.

    Args:
        value: What stands there.
        path: Where, for example ``input.poses[1]``.
        frames: What is known of tools and locals that poses in it may name.
    """

    def __init__(self, value: object, path: str, frames: "KnownFrames | None" = None) -> None:
        if not isinstance(value, dict):
            raise unusable(path, tr("expected: an object"))
        self.frames = frames or KnownFrames()
        self._value: dict[str, object] = value
        self._read: set[str] = set()
        self.path = path

    def __contains__(self, name: str) -> bool:
        return name in self._value

    def __iter__(self) -> Iterator[str]:
        return iter(self._value)

    def is_object(self, name: str) -> bool:
        """Return whether ``name`` holds an object; elsewhere the name may mean another."""
        return isinstance(self._value.get(name), dict)

    def at(self, name: str) -> str:
        """Return the path of ``name`` in this object."""
        return f"{self.path}.{name}" if self.path else name

    def raw(self, name: str) -> object:
        """Return the value under ``name``, whatever it is.

        Raises:
            ConfigError: There is nothing.
        """
        self._read.add(name)
        if name not in self._value:
            raise unusable(self.at(name), tr("it is missing"))
        return self._value[name]

    def ignore(self, *names: str) -> None:
        """Accept names that mean nothing to a solver."""
        self._read.update(names)

    def number(self, name: str) -> float:
        """Return a finite number.

        Raises:
            CalibrationError: ``non_finite``, with the path.
            ConfigError: It is missing.
        """
        return finite(self.raw(name), self.at(name))

    def optional(self, name: str, read: "Callable[[str], T]") -> T | None:
        """Return ``read(name)``, or ``None`` where the name is missing."""
        self._read.add(name)
        return read(name) if name in self._value else None

    def number_or(self, name: str, default: float) -> float:
        """Return a finite number, or ``default`` where the name is missing."""
        return self.number(name) if name in self._value else default

    def text(self, name: str, *allowed: str) -> str:
        """Return one of the allowed words.

        Raises:
            ConfigError: It is another.
        """
        value = self.raw(name)
        if not isinstance(value, str):
            raise unusable(self.at(name), tr("{value!r} is not a text", value=value))
        if allowed and value not in allowed:
            raise ConfigError(
                tr("{path}: {value!r} is not known.", path=self.at(name), value=value),
                remedy=known_names(allowed, value),
            )
        return value

    def whole(self, name: str) -> int:
        """Return a whole number."""
        value = self.number(name)
        if value != int(value):
            raise unusable(self.at(name), tr("expected: a whole number"))
        return int(value)

    def flag(self, name: str) -> bool:
        """Return whether true stands under ``name``; null is false."""
        value = self.raw(name)
        if not isinstance(value, (bool, type(None))):
            raise unusable(self.at(name), tr("expected: true or false"))
        return bool(value)

    def child(self, name: str) -> "Node":
        """Return the object under ``name``."""
        return Node(self.raw(name), self.at(name), self.frames)

    def items(self, name: str) -> Iterator[tuple[object, str]]:
        """Yield the items of the list under ``name``, each with its path."""
        value = self.raw(name)
        if not isinstance(value, list):
            raise unusable(self.at(name), tr("expected: a list"))
        for index, item in enumerate(value):
            yield item, f"{self.at(name)}[{index}]"

    def children(self, name: str) -> list["Node"]:
        """Return the objects of the list under ``name``."""
        return [Node(value, path, self.frames) for value, path in self.items(name)]

    def numbers(self, name: str) -> list[float]:
        """Return the numbers of the list under ``name``."""
        return [finite(value, path) for value, path in self.items(name)]

    def each(self, name: str, kind: type[T]) -> list[T]:
        """Return the objects of the list under ``name``, as :data:`_READERS` reads them."""
        return [cast("T", _READERS[kind](child)) for child in self.children(name)]

    def call(self, function: "Callable[..., T]", names: str, **known: object) -> T:
        """Call a function with the values under these names.

        Each is read as the annotation of its parameter says; where it is missing, the parameter
        keeps its default. A parameter ``z_mm`` or ``v_deg`` may be called ``z`` or ``v``.

        Args:
            function: A solver, or a class of values.
            names: Those of the file, in the order in which they are read.
            **known: Further arguments.

        Raises:
            CalibrationError: As the function says; ``non_finite``.
            ConfigError: Something is missing, or is no such value; names the path.
        """
        parameters = _signature(function).parameters
        for name in names.split():
            full = next(n for n in (name, f"{name}_mm", f"{name}_deg") if n in parameters)
            if name in self or parameters[full].default is Parameter.empty:
                known[full] = self._value_of(name, parameters[full].annotation)
        return function(**known)

    def made(self, kind: "Callable[..., T]", names: str, **known: object) -> T:
        """Return the result of :meth:`call` for this object, which may hold no other name."""
        found = self.call(kind, names, **known)
        self.finish()
        return found

    def _value_of(self, name: str, kind: Any) -> object:  # noqa: ANN401 - whatever annotates
        """Return the value under ``name`` as a value of a type, or of a type or ``None``."""
        parts = get_args(kind)
        if type(None) in parts:
            return self._value_of(name, parts[0])
        if get_origin(kind) is Literal:
            return self.text(name, *parts)
        if parts:
            return tuple(self.numbers(name)) if parts[0] is float else self.each(name, parts[0])
        plain = {float: self.number, int: self.whole, bool: self.flag}.get(kind)
        return plain(name) if plain else _READERS[kind](self.child(name))

    def finish(self) -> None:
        """Refuse names that nobody asked for.

        Raises:
            ConfigError: Names the first unknown path.
        """
        unknown = sorted(set(self._value) - self._read)
        if unknown:
            raise unusable(self.at(unknown[0]), tr("unknown name"))


@cache
def _signature(function: "Callable[..., object]") -> Signature:
    return signature(function, eval_str=True)


def finite(value: object, path: str) -> float:
    """Return a finite number.

    Raises:
        CalibrationError: ``non_finite``, with the path.
    """
    usable = isinstance(value, (int, float)) and not isinstance(value, bool)
    found = float(value) if usable and abs(value) < _HUGE else math.nan  # type: ignore[arg-type]
    if math.isnan(found):
        raise CalibrationError(
            "non_finite",
            tr("{path} is {value!r}.", path=path, value=value),
            remedy=tr("Give finite numbers in mm and degrees."),
        )
    return found


def read_pose(node: Node) -> Pose:
    """Return a pose: x and y in mm, u in degrees; z, v, w, hand, local and tool if given.

    In place of the angles a quaternion may stand, qx, qy, qz and the scalar qs.
    """
    hand = node.optional("hand", lambda name: Hand(node.text(name, *Hand)))
    u_deg, v_deg, w_deg = _angles_deg(node)
    pose = Pose(
        x_mm=node.number("x"),
        y_mm=node.number("y"),
        z_mm=node.number_or("z", 0.0),
        u_deg=u_deg,
        v_deg=v_deg,
        w_deg=w_deg,
        hand=hand,
        local=node.optional("local", node.whole) or 0,
        tool=node.optional("tool", node.whole),
    )
    node.finish()
    return node.frames.flange(pose)


def read_facts(node: Node) -> cal.AccuracyFacts:
    """Return the stated rows of a case's budget.

    Each row is a positive half width by its key; ``months`` says how long ago the station was
    learnt, ``by_contact`` whether an input showed each touch.
    """
    rows = {
        key: cal.RowFact(_positive(node, key), "stated", told=tr("stated in the case"))
        for key in cal.ACCURACY_ROWS
        if key in node
    }
    months = node.optional("months", node.number)
    if months is not None and months < 0:
        raise unusable(node.at("months"), tr("it is below 0"))
    by_contact = node.optional("by_contact", node.raw) or False
    if not isinstance(by_contact, bool):
        raise unusable(node.at("by_contact"), tr("expected: true or false"))
    node.finish()
    return cal.AccuracyFacts(rows=rows, months=months, by_contact=by_contact)


def _positive(node: Node, name: str) -> float:
    value = node.number(name)
    if value <= 0:
        raise unusable(node.at(name), tr("expected: a number above 0"))
    return value


def read_frames(node: Node) -> None:
    """Read the values of ``tools`` and ``locals`` in which the poses of a case are given."""
    node.frames = KnownFrames(
        *(_by_number(node.child(name)) if node.is_object(name) else {} for name in _FRAMES)
    )


def _by_number(node: Node) -> dict[int, ToolOffset]:
    found = {}
    for name in node:
        if not name.isdecimal():
            raise unusable(node.at(name), tr("expected: the number of a tool or local"))
        found[int(name)] = read_offset(node.child(name))
    return found


def _angles_deg(node: Node) -> tuple[float, float, float]:
    if "qs" not in node:
        return node.number("u"), node.number_or("v", 0.0), node.number_or("w", 0.0)
    quaternion = [node.number(name) for name in ("qx", "qy", "qz", "qs")]
    if abs(math.hypot(*quaternion) - 1) > _UNIT_WITHIN:
        raise unusable(node.path, tr("the quaternion's length is not 1"))
    import numpy as np

    return cal.uvw_deg(cal.quaternion_rotations(np.array([quaternion]))[0])


def read_poses(node: Node, name: str = "poses") -> list[Pose]:
    """Return the poses of a list."""
    return [read_pose(child) for child in node.children(name)]


def read_offset(node: Node) -> ToolOffset:
    """Return a tool offset; what is not given is 0."""
    return node.made(ToolOffset, "x y z u v w")


def read_place(node: Node, axes: str = "") -> tuple[float, ...]:
    """Return the coordinates of a place on these axes, mm; else x, y and, if given, z."""
    place = tuple(map(node.number, axes or ("xyz" if "z" in node else "xy")))
    node.finish()
    return place


def read_sighting(node: Node) -> cal.Sighting:
    """Return where a camera saw a tip or a mark; other names may stand beside ``flange``."""
    return cal.Sighting(read_pose(node.child("flange")), *read_place(node.child("tip")))


def _fiducial(node: Node) -> cal.Sighting:
    sighting = read_sighting(node)
    node.finish()
    return sighting


def _pixel(node: Node) -> cal.PixelSighting:
    px, py = node.number("px"), node.number("py")
    return cal.PixelSighting(read_pose(node), px, py)


def _camera(node: Node) -> cal.CameraModel:
    matrix, origin = node.numbers("mm_per_px_matrix"), node.numbers("camera_origin")
    node.finish()
    if len(matrix) != 4 or len(origin) != 2:
        raise unusable(node.path, tr("expected: four numbers for the matrix, two for the origin"))
    a, b, c, d = matrix
    if a * d == b * c:
        raise unusable(node.at("mm_per_px_matrix"), tr("the camera matrix has no inverse"))
    return cal.CameraModel(((a, b), (c, d)), (origin[0], origin[1]))


def _plane(node: Node) -> cal.TouchedPlane:
    normal, distance = node.numbers("normal"), node.number("distance_mm")
    node.finish()
    if len(normal) != 3 or not any(normal):
        raise unusable(node.at("normal"), tr("expected: three numbers, not all 0"))
    return cal.TouchedPlane((normal[0], normal[1], normal[2]), distance)


def _crossing(node: Node) -> cal.Crossing:
    beam = node.whole("beam")
    if beam not in (1, 2):
        raise unusable(node.at("beam"), tr("expected: beams numbered 1 and 2"))
    return node.made(cal.Crossing, "entry exit", beam=beam - 1)


def _record(kind: "Callable[..., object]", names: str) -> "Callable[[Node], object]":
    return lambda node: node.made(kind, names)


_READERS: Final["Mapping[object, Callable[[Node], object]]"] = {
    Pose: read_pose,
    ToolOffset: read_offset,
    WorkBox: _record(WorkBox, "x_min_mm x_max_mm y_min_mm y_max_mm z_min_mm z_max_mm"),
    cal.Beam: _record(cal.Beam, "x y direction_deg sigma_mm direction_sigma_deg correlation"),
    cal.CameraModel: _camera,
    cal.Crossing: _crossing,
    cal.JointTouch: _record(cal.JointTouch, "pin tool flange"),
    cal.PixelSighting: _pixel,
    cal.ShaftSeen: _record(cal.ShaftSeen, "crossings above_mm deeper_mm"),
    cal.Sighting: _fiducial,
    cal.Standoff: _record(cal.Standoff, "x y z"),
    cal.Touch: _record(cal.Touch, "z speed_mm_s"),
    cal.TouchedPlane: _plane,
}
"""Readers of the objects in the file, by the type that a solver takes."""


def unusable(path: str, why: str) -> ConfigError:
    """Return the error for a file with a wrong layout."""
    return ConfigError(
        tr("{path}: {why}.", path=path or tr("the file"), why=why),
        remedy=tr("Correct the file. See what each method takes: docs/solvers.md"),
    )
