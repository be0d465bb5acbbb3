"""Reading a case: every value knows its path, and nothing is read past unknown names."""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Final, TypeVar

from robolink.calibration import ACCURACY_ROWS, AccuracyFacts, RowFact
from robolink.errors import CalibrationError, ConfigError
from robolink.messages import tr
from robolink.model import Hand, Pose, ToolOffset

EULER: Final = "R=Rz(U)Ry(V)Rx(W)"

T = TypeVar("T")

_HUGE: Final = 1e12
"""No length or angle of a cell is larger, and squares of what is smaller are finite."""

_UNIT_WITHIN: Final = 0.01

_FRAMES: Final = ("tools", "locals")


@dataclass(frozen=True, slots=True)
class KnownFrames:
    """Values of the tools and locals that poses of a case may have been taken in.

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
        from robolink.calibration import flange_poses

        return flange_poses([pose], tools=self.tools, local_frames=self.local_frames)[0]


class Node:
    """An object of the file.

    Args:
        value: What stands there.
        path: Where, for example ``input.poses[1]``.
        frames: What is known of tools and locals that poses in it may name.
    """

    def __init__(self, value: object, path: str, frames: "KnownFrames | None" = None) -> None:
        if not isinstance(value, dict):
            raise unusable(path, tr("an object is expected here"))
        self.frames = frames or KnownFrames()
        self._value: dict[str, object] = value
        self._read: set[str] = set()
        self.path = path

    def __contains__(self, name: str) -> bool:
        return name in self._value

    def __iter__(self) -> Iterator[str]:
        return iter(self._value)

    def is_object(self, name: str) -> bool:
        """Tell whether an object stands under ``name``; elsewhere the name may mean another."""
        return isinstance(self._value.get(name), dict)

    def items(self, name: str) -> Iterator[tuple[object, str]]:
        """Yield what stands in the list under ``name``, each with its path."""
        return self._items(name)

    def at(self, name: str) -> str:
        """Return the path of ``name`` in this object."""
        return f"{self.path}.{name}" if self.path else name

    def raw(self, name: str) -> object:
        """Return whatever stands under ``name``.

        Raises:
            ConfigError: There is nothing.
        """
        self._read.add(name)
        if name not in self._value:
            raise unusable(self.at(name), tr("it is missing"))
        return self._value[name]

    def ignore(self, *names: str) -> None:
        """Know names that mean nothing to a solver."""
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
        """Return one of the words that are allowed.

        Raises:
            ConfigError: It is another.
        """
        value = self.raw(name)
        if not isinstance(value, str) or (allowed and value not in allowed):
            raise unusable(
                self.at(name),
                tr("{value!r} is not one of: {words}", value=value, words=", ".join(allowed)),
            )
        return value

    def whole(self, name: str) -> int:
        """Return a whole number."""
        value = self.number(name)
        if value != int(value):
            raise unusable(self.at(name), tr("a whole number is expected here"))
        return int(value)

    def child(self, name: str) -> "Node":
        """Return the object under ``name``."""
        return Node(self.raw(name), self.at(name), self.frames)

    def children(self, name: str) -> list["Node"]:
        """Return the objects of the list under ``name``."""
        return [Node(value, path, self.frames) for value, path in self._items(name)]

    def numbers(self, name: str) -> list[float]:
        """Return the numbers of the list under ``name``."""
        return [finite(value, path) for value, path in self._items(name)]

    def finish(self) -> None:
        """Refuse what nobody asked for.

        Raises:
            ConfigError: Names the first unknown path.
        """
        unknown = sorted(set(self._value) - self._read)
        if unknown:
            raise unusable(self.at(unknown[0]), tr("this name is not known here"))

    def _items(self, name: str) -> Iterator[tuple[object, str]]:
        value = self.raw(name)
        if not isinstance(value, list):
            raise unusable(self.at(name), tr("a list is expected here"))
        for index, item in enumerate(value):
            yield item, f"{self.at(name)}[{index}]"


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


def read_facts(node: Node) -> AccuracyFacts:
    """Return what a case states of the rows of its budget.

    Each row is a positive half width by its key; ``months`` says how long ago the station was
    learnt, ``by_contact`` whether an input showed each touch.
    """
    rows = {
        key: RowFact(_positive(node, key), "stated", told=tr("stated in the case"))
        for key in ACCURACY_ROWS
        if key in node
    }
    months = node.optional("months", node.number)
    if months is not None and months < 0:
        raise unusable(node.at("months"), tr("it is below 0"))
    by_contact = node.optional("by_contact", node.raw) or False
    if not isinstance(by_contact, bool):
        raise unusable(node.at("by_contact"), tr("true or false is expected here"))
    node.finish()
    return AccuracyFacts(rows=rows, months=months, by_contact=by_contact)


def _positive(node: Node, name: str) -> float:
    value = node.number(name)
    if value <= 0:
        raise unusable(node.at(name), tr("a number above 0 is expected here"))
    return value


def read_frames(node: Node) -> None:
    """Read the values of ``tools`` and ``locals`` that the poses of a case are given in."""
    node.frames = KnownFrames(
        *(_by_number(node.child(name)) if node.is_object(name) else {} for name in _FRAMES)
    )


def _by_number(node: Node) -> dict[int, ToolOffset]:
    found = {}
    for name in node:
        if not name.isdecimal():
            raise unusable(node.at(name), tr("the number of a tool or local is expected here"))
        found[int(name)] = read_offset(node.child(name))
    return found


def _angles_deg(node: Node) -> tuple[float, float, float]:
    if "qs" not in node:
        return node.number("u"), node.number_or("v", 0.0), node.number_or("w", 0.0)
    quaternion = [node.number(name) for name in ("qx", "qy", "qz", "qs")]
    if abs(math.hypot(*quaternion) - 1) > _UNIT_WITHIN:
        raise unusable(node.path, tr("the quaternion's length is not 1"))
    import numpy as np

    from robolink.calibration import quaternion_rotations, uvw_deg

    return uvw_deg(quaternion_rotations(np.array([quaternion]))[0])


def read_poses(node: Node, name: str = "poses") -> list[Pose]:
    """Return the poses of a list."""
    return [read_pose(child) for child in node.children(name)]


def read_offset(node: Node) -> ToolOffset:
    """Return a tool offset; what is not given is 0."""
    offset = ToolOffset(*(node.number_or(name, 0.0) for name in "xyzuvw"))
    node.finish()
    return offset


def read_point(node: Node) -> tuple[float, float]:
    """Return x and y in mm."""
    point = (node.number("x"), node.number("y"))
    node.finish()
    return point


def unusable(path: str, why: str) -> ConfigError:
    """Return the error for a file that is not laid out as it should be."""
    return ConfigError(
        tr("{path}: {why}.", path=path or tr("the file"), why=why),
        remedy=tr("docs/solvers.md shows what each method takes."),
    )
