"""What a test asks of its simulated cell, by the marker ``robolink`` or of a factory."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, fields
from numbers import Real
from pathlib import Path
from typing import Any, Final

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.model import ToolOffset

_OF_ALL: Final = frozenset({"seed", "faults", "speed"})
_OF_A_WORLD: Final = _OF_ALL | {"options", "world", "true_tool"}

HEEDED: Final[Mapping[str, frozenset[str]]] = {
    "epson": _OF_A_WORLD | {"robot", "password"},
    "softmotion": _OF_A_WORLD | {"kinematics", "program"},
    "plc": _OF_ALL | {"map"},
}
"""What the cells of each kind pay heed to."""

FASTEST: Final = 1000.0
"""The highest ``speed``, as of ``robolink sim --speed``."""


@dataclass(frozen=True, slots=True)
class CellRequest:
    """How a simulated cell is to be.

    Attributes:
        robot: Model of an EPSON robot, for example ``C8-C901S``.
        kinematics: Of a PLC, for example ``Kin_Gantry3+Kin_CAxis``.
        seed: Another cell: other tools, another tip; ``None`` for that of the test run.
        password: Of Remote Ethernet.
        options: Habits of the controller by name, as ``robolink sim --option`` has them.
        world: What goes wrong around the robot by name, as ``robolink sim --world`` has them.
        faults: A fault plan: a file, or faults as a file has them, one mapping each.
        speed: Simulated seconds per real one, on a port; 0 lets time pass with requests alone.
        true_tool: Where the tip of tool 1 really is: x, y, z in mm, and u, v, w in degrees.
        map: The map of a PLC with registers of its own.
        program: A folder with the program of a SoftMotion PLC, as ``expert plc export`` writes
            it, changed or not; ``None`` for the modelled one.
    """

    robot: str = "T6-602S"
    kinematics: str = "Kin_Scara3_Z"
    seed: int | None = None
    password: str = ""
    options: Mapping[str, object] | None = None
    world: Mapping[str, object] | None = None
    faults: str | Path | tuple[Mapping[str, object], ...] | list[Mapping[str, object]] = ()
    speed: float | None = None
    true_tool: tuple[float, ...] | None = None
    map: str | Path | None = None
    program: str | Path | None = None

    @classmethod
    def of(cls, given: Mapping[str, Any]) -> "CellRequest":
        """Return what was asked for by name.

        Raises:
            ConfigError: There is no such name, or its value is not of the form that it takes.
        """
        names = tuple(field.name for field in fields(cls))
        for name in given:
            if name not in names:
                raise ConfigError(
                    tr("A simulated cell has no parameter {name!r}.", name=name),
                    remedy=tr("These are known: {names}.", names=", ".join(names)),
                )
        for name, value in given.items():
            takes, example = _FORMS[name]
            if not takes(value):
                raise ConfigError(
                    tr("{name} of a simulated cell cannot be {value!r}.", name=name, value=value),
                    remedy=tr("Give it as {example}.", example=example),
                )
        return cls(**given)

    @property
    def tip(self) -> ToolOffset | None:
        """Where the tip of tool 1 really is; ``None`` for where the seed puts it."""
        return None if self.true_tool is None else ToolOffset(*self.true_tool)

    def texts(self, name: str) -> dict[str, str]:
        """Return options or world as text, as the command line and URLs have them."""
        given: Mapping[str, object] = getattr(self, name) or {}
        return {
            key: str(int(value)) if isinstance(value, bool) else str(value)
            for key, value in given.items()
        }


def require_heeded(names: Iterable[str], kinds: Iterable[str]) -> None:
    """Refuse what no cell of the kinds that a test has would pay heed to.

    Args:
        names: What was given, of the fields of :class:`CellRequest`.
        kinds: Of :data:`HEEDED`, at least one.

    Raises:
        ConfigError: There is such a name.
    """
    kinds = sorted(kinds)
    heeded = frozenset[str]().union(*(HEEDED[kind] for kind in kinds))
    for name in names:
        if name not in heeded:
            raise ConfigError(
                tr(
                    "No simulated cell of this kind ({kinds}) pays heed to {name!r}.",
                    kinds=", ".join(kinds),
                    name=name,
                ),
                remedy=tr("These are known: {names}.", names=", ".join(sorted(heeded))),
            )


def require_time_of_its_own(medium: str, names: Iterable[str]) -> None:
    """Refuse a speed for a cell in the process, whose time passes while somebody waits for it.

    Raises:
        ConfigError: One was given to it.
    """
    if medium == "sim" and "speed" in names:
        raise ConfigError(
            tr("The time of this simulator passes only while somebody waits for it."),
            remedy=tr("Serve it on a port, or let time pass with the act step."),
        )


def _text(value: object) -> bool:
    return isinstance(value, str)


def _place(value: object) -> bool:
    return value is None or isinstance(value, (str, Path))


def _named(value: object) -> bool:
    return value is None or isinstance(value, Mapping)


def _numbers(value: object) -> bool:
    return value is None or (isinstance(value, (tuple, list)) and len(value) in (3, 6))


def _seed(value: object) -> bool:
    return value is None or (type(value) is int and value >= 0)


def _speed(value: object) -> bool:
    number = isinstance(value, Real) and not isinstance(value, bool)
    return value is None or (number and 0 <= value <= FASTEST)  # type: ignore[operator]


def _faults(value: object) -> bool:
    listed = isinstance(value, (tuple, list)) and all(isinstance(it, Mapping) for it in value)
    return listed or isinstance(value, (str, Path))


_FORMS: Final[Mapping[str, tuple[Callable[[object], bool], str]]] = {
    "robot": (_text, 'robot="C8-C901S"'),
    "kinematics": (_text, 'kinematics="Kin_5Axes"'),
    "seed": (_seed, "seed=3"),
    "password": (_text, 'password="..."'),
    "options": (_named, 'options={"terminator": "cr"}'),
    "world": (_named, 'world={"eye_sigma_mm": 0.05}'),
    "faults": (_faults, 'faults=[{"action": "drop_reply", "match": "TLSet 2, XY"}]'),
    "speed": (_speed, "speed=20"),
    "true_tool": (_numbers, "true_tool=(12.4, -3.2, -20.1)"),
    "map": (_place, 'map="machine.toml"'),
    "program": (_place, 'program="our-plc"'),
}
"""Which form each takes, and an example of it."""
