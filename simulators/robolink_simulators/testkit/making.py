"""Makes simulated controllers of each kind and serves them, for a test."""

import sys
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, fields
from numbers import Real
from pathlib import Path
from typing import Any, Final

from robolink.errors import ConfigError
from robolink.messages import known_names, tr
from robolink.model import Secret, ToolOffset
from robolink_simulators.cell.clock import EXCHANGE_S, ManualClock, SteeredClock
from robolink_simulators.cell.workplace import MOUNTED_TOOL
from robolink_simulators.cell.world_parameters import WorldParameters, parameters_from_text
from robolink_simulators.faults import LinkKind, faults_of_table, read_fault_file
from robolink_simulators.testkit.media import served
from robolink_simulators.testkit.operator import written_map, written_recipe, written_symbol_map
from robolink_simulators.testkit.served import OwnFolder, SimulatedCell

_OF_ALL: Final = frozenset({"seed", "faults", "speed", "answer_ms"})
_OF_A_WORLD: Final = _OF_ALL | {"options", "world", "true_tool"}

HEEDED: Final[Mapping[str, frozenset[str]]] = {
    "epson": _OF_A_WORLD | {"robot", "password"},
    "softmotion": _OF_A_WORLD | {"kinematics", "program"},
    "plc": _OF_ALL | {"map"},
}
"""Parameters that the cells of each kind use."""

FASTEST: Final = 1000.0
"""Highest ``speed``, as for ``robolink sim --speed``."""


@dataclass(frozen=True, slots=True)
class CellRequest:
    """The requested properties of a simulated cell.

    Attributes:
        robot: Model of an EPSON robot, for example ``C8-C901S``.
        kinematics: Of a PLC, for example ``Kin_Gantry3+Kin_CAxis``.
        seed: Another cell: other tools, another tip; ``None`` for that of the test run.
        password: Of Remote Ethernet.
        options: Habits of the controller by name, as ``robolink sim --option`` has them.
        world: What goes wrong around the robot by name, as ``robolink sim --world`` has them.
        faults: A fault plan: a file, or faults as a file has them, one mapping each.
        speed: Simulated seconds per real one, on a port; 0 lets time pass with requests alone.
        answer_ms: How long after a request its answer leaves, in simulated milliseconds.
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
    answer_ms: float = 0.0
    true_tool: tuple[float, ...] | None = None
    map: str | Path | None = None
    program: str | Path | None = None

    @classmethod
    def of(cls, given: Mapping[str, Any]) -> "CellRequest":
        """Return a request from its named parts.

        Raises:
            ConfigError: There is no such name, or its value is not of the form that it takes.
        """
        names = tuple(field.name for field in fields(cls))
        for name in given:
            if name not in names:
                raise ConfigError(
                    tr("A simulated cell has no parameter {name!r}.", name=name),
                    remedy=known_names(names, name),
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
    """Refuse options that no cell of the test's kinds would use.

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
                    "No simulated cell of this kind ({kinds}) uses {name!r}.",
                    kinds=", ".join(kinds),
                    name=name,
                ),
                remedy=known_names(sorted(heeded)),
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


def _seed_of(value: object) -> bool:
    return value is None or (type(value) is int and value >= 0)


def _speed(value: object) -> bool:
    number = isinstance(value, Real) and not isinstance(value, bool)
    return value is None or (number and 0 <= value <= FASTEST)  # type: ignore[operator]


def _answer_ms(value: object) -> bool:
    return isinstance(value, Real) and not isinstance(value, bool)


def _faults(value: object) -> bool:
    listed = isinstance(value, (tuple, list)) and all(isinstance(it, Mapping) for it in value)
    return listed or isinstance(value, (str, Path))


_FORMS: Final[Mapping[str, tuple[Callable[[object], bool], str]]] = {
    "robot": (_text, 'robot="C8-C901S"'),
    "kinematics": (_text, 'kinematics="Kin_5Axes"'),
    "seed": (_seed_of, "seed=3"),
    "password": (_text, 'password="..."'),
    "options": (_named, 'options={"terminator": "cr"}'),
    "world": (_named, 'world={"eye_sigma_mm": 0.05}'),
    "faults": (_faults, 'faults=[{"action": "drop_reply", "match": "TLSet 2, XY"}]'),
    "speed": (_speed, "speed=20"),
    "answer_ms": (_answer_ms, "answer_ms=20"),
    "true_tool": (_numbers, "true_tool=(12.4, -3.2, -20.1)"),
    "map": (_place, 'map="machine.toml"'),
    "program": (_place, 'program="our-plc"'),
}
"""Form of each parameter, and an example."""


SERVED_SPEED: Final = 20.0
"""Simulated seconds per real second on a port."""

PROGRAM_SPEED: Final = 1.0
"""Simulated seconds per real second of a PLC that executes a program. The program counts the 500 ms
between two heartbeats in its own cycles. On a busy build machine a client need not be faster than a
real one.
"""

PROGRAM_EXCHANGE_S: Final = 0.005
"""Duration of each request to such a PLC in seconds: a hundredth of these 500 ms."""


def make_epson(
    own: OwnFolder,
    request: CellRequest,
    medium: str,
    clock: ManualClock | None,
    *,
    person: bool = False,
) -> SimulatedCell:
    """Make an EPSON controller and serve it.

    Args:
        own: Where.
        request: How it is to be.
        medium: ``sim`` in the process, ``tcp``, or ``serial`` (not on Windows).
        clock: Its time in the process; of its own where that is left out.
        person: Whether there is a person, and a recipe.

    Raises:
        ConfigError: What is asked for does not exist.
    """
    from robolink_simulators.epson.device import EpsonSimulator
    from robolink_simulators.epson.options import options_from_text

    simulator = EpsonSimulator(
        request.robot,
        seed=_seed(own, request),
        password=Secret(request.password) if request.password else None,
        options=options_from_text(request.texts("options")),
        world=_world(request),
        answer_ms=request.answer_ms,
    )
    time = _time(request, medium, clock)
    url = own.stack.enter_context(served(simulator, medium, clock=time))
    return _furnished(own, simulator, time, {medium: url}, request, person=person)


def make_softmotion(
    own: OwnFolder,
    request: CellRequest,
    medium: str,
    clock: ManualClock | None,
    *,
    person: bool = False,
) -> SimulatedCell:
    """Make a PLC with a mailbox and serve it; as :func:`make_epson`.

    Args:
        own: Where.
        request: How it is to be.
        medium: ``sim``, ``modbus-tcp``, ``modbus-rtu`` (not on Windows), ``can``, ``opcua`` or
            ``opcua-secured`` (with asyncua).
        clock: Its time in the process; of its own where that is left out.
        person: Whether there is a person, and a recipe.

    Raises:
        ConfigError: What is asked for does not exist.
    """
    from robolink_simulators.softmotion.mailbox.option_text import options_from_text
    from robolink_simulators.softmotion.mailbox.simulator import SoftMotionSimulator
    from robolink_simulators.softmotion.program.structured_plc import plc_maker

    simulator = SoftMotionSimulator(
        request.kinematics,
        seed=_seed(own, request),
        options=options_from_text(request.texts("options")),
        world=_world(request),
        answer_ms=request.answer_ms,
        make_plc=plc_maker(None if request.program is None else Path(request.program)),
    )
    time = _time(request, medium, clock)
    url = own.stack.enter_context(served(simulator, medium, clock=time))
    return _furnished(own, simulator, time, {medium: url}, request, person=person)


def make_plc(
    own: OwnFolder, request: CellRequest, medium: str, clock: ManualClock | None
) -> SimulatedCell:
    """Make a PLC with a register map and serve it; as :func:`make_epson`.

    Args:
        own: Where.
        request: How it is to be; without a map it has two tools, with a commit bit.
        medium: ``modbus-tcp``, ``modbus-rtu`` (not on Windows), ``opcua`` or
            ``opcua-secured`` (with asyncua), or ``sim``.
        clock: Its time in the process; of its own where that is left out.

    Raises:
        ConfigError: What is asked for does not exist.
    """
    from robolink.register_maps import load_plc_map
    from robolink_simulators.plc import PlcSimulator

    written = written_symbol_map if medium.startswith("opcua") else written_map
    path = written(own.folder) if request.map is None else Path(request.map)
    seed = _seed(own, request)
    simulator = PlcSimulator(load_plc_map(path), seed=seed, answer_ms=request.answer_ms)
    time = _time(request, medium, clock)
    url = own.stack.enter_context(served(simulator, medium, clock=time, map_file=path))
    return _furnished(own, simulator, time, {medium: url}, request, person=False)


def serve_made(
    own: OwnFolder,
    simulator: Any,  # noqa: ANN401 - of any kind
    medium: str,
    clock: Any,  # noqa: ANN401 - stepped or steered
    map_file: Path | None,
) -> SimulatedCell:
    """Serve a simulator that the test has made; see :func:`~.media.served`.

    Args:
        own: Where.
        simulator: Of any kind.
        medium: How it is reached.
        clock: Its time; that of a cell by default.
        map_file: The file of the map of a PLC that has one.

    Raises:
        ConfigError: There is no such medium.
    """
    time = clock or _time(CellRequest(), medium, None)
    url = own.stack.enter_context(served(simulator, medium, clock=time, map_file=map_file))
    own.stack.callback(_forget_record, url)
    return own.keep(simulator, time, {medium: url})


def _furnished(
    own: OwnFolder,
    simulator: Any,  # noqa: ANN401 - of any kind
    clock: Any,  # noqa: ANN401 - stepped or steered
    urls: dict[str, str],
    request: CellRequest,
    *,
    person: bool,
) -> SimulatedCell:
    if request.tip is not None:
        simulator.world.tips[MOUNTED_TOOL] = request.tip
    (url,) = urls.values()
    own.stack.callback(_forget_record, url)
    _plan(simulator, request, LinkKind(url.partition("://")[0]))
    if not person:
        return own.keep(simulator, clock, urls)
    assist = url
    if isinstance(clock, SteeredClock):
        from robolink_simulators.control.assist import serve_assist

        assist = own.stack.enter_context(serve_assist(simulator, clock=clock)).url
    return own.keep(simulator, clock, urls, assist=assist, recipe=written_recipe(own.folder))


def _forget_record(url: str) -> None:
    """Forget the records, in memory, of a cell that no other process reaches."""
    if "robolink.journal" in sys.modules:
        from robolink.journal import forget_memory
        from robolink.transport import parse_url

        forget_memory(parse_url(url).identity)


def _plan(simulator: Any, request: CellRequest, link: LinkKind) -> None:  # noqa: ANN401 - of any kind
    if isinstance(request.faults, (str, Path)):
        plan = read_fault_file(Path(request.faults))
        simulator.faults.plan(plan.faults, plan.seed, {link})
    elif request.faults:
        simulator.faults.plan(faults_of_table(request.faults, link), simulator.seed, {link})


def _time(request: CellRequest, medium: str, clock: ManualClock | None) -> Any:  # noqa: ANN401 - stepped or steered
    """Return the clock of a cell; in real time, which a test requested, requests take none."""
    if medium == "sim":
        return clock or ManualClock()
    speed, exchange_s = SERVED_SPEED, EXCHANGE_S
    if request.program is not None:
        speed, exchange_s = PROGRAM_SPEED, PROGRAM_EXCHANGE_S
    factor = speed if request.speed is None else request.speed
    return SteeredClock(factor, exchange_s=0.0 if request.speed == 1 else exchange_s)


def _world(request: CellRequest) -> WorldParameters:
    return WorldParameters(**parameters_from_text(request.texts("world")))  # type: ignore[arg-type]


def _seed(own: OwnFolder, request: CellRequest) -> int:
    return own.seed if request.seed is None else request.seed
