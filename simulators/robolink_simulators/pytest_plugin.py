"""Pytest fixtures with simulated controllers; tests connect by URL themselves.

What robolink would keep about a controller in the tester's own state folder (journal, markers,
backups) goes into a folder of the test's own. docs/testing.md shows each fixture.

Nothing is used unless a test asks for it, and importing this module costs next to nothing: every
pytest run of an environment in which robolink is installed imports it.
"""

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import pytest

if TYPE_CHECKING:
    from robolink.journal import Journal
    from robolink_simulators.cell.clock import ManualClock
    from robolink_simulators.testkit.making import CellRequest
    from robolink_simulators.testkit.served import OwnFolder, SimulatedCell

_STATE: Final = ("ROBOLINK_STATE_DIR", "ROBOLINK_JOURNAL")
"""Variables that name the places of the journal, the backups and other state."""

_OF_THE_DEVELOPER: Final = {name: os.environ.get(name) for name in _STATE}

_BEFORE: Final = {name: os.environ[name] for name in os.environ if name.startswith("ROBOLINK_")}
"""robolink's environment variables as they were before pytest started."""

_MARKER: Final = "robolink"
_CELLS: Final = pytest.StashKey[list["SimulatedCell"]]()
"""Key of a test's simulated cells."""

_NOT_PASSED: Final = pytest.StashKey[bool]()
"""Key of a flag: the test has already failed or been skipped."""

Factory = Callable[..., "SimulatedCell"]
"""Makes one more cell. Takes the marker's arguments and ``medium``."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add ``--robolink-seed``."""
    group = parser.getgroup("robolink")
    group.addoption(
        "--robolink-seed",
        type=_seed,
        default=1,
        metavar="N",
        help="seed of the simulated controllers (default: 1)",
    )


def pytest_configure(config: pytest.Config) -> None:
    """Declare the marker."""
    config.addinivalue_line(
        "markers",
        "robolink(robot, kinematics, seed, password, options, world, faults, speed, true_tool, "
        "answer_ms, map, program): how the simulated cells of this test are to be "
        "(docs/testing.md)",
    )


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item,
    call: pytest.CallInfo[None],  # noqa: ARG001 - part of the hook
) -> Any:  # noqa: ANN401 - what the hook gives
    """Attach wire log, seed and state of the simulated cells to a test that failed.

    They are sections of what is printed, and properties of the test: those stand in the file
    that ``--junitxml`` writes. With the teardown of a test its cells are let go, since pytest
    holds the tests themselves to the end of the run; and one that is tried again begins anew.
    """
    report: pytest.TestReport = yield
    cells: list[SimulatedCell] | None = item.stash.get(_CELLS, None)
    if report.failed and cells:
        from robolink_simulators.testkit.served import sections_of

        sections = sections_of(cells)
        report.sections += sections
        if not item.stash.get(_NOT_PASSED, False):
            # The report of the teardown takes these up; pytest writes its properties.
            item.user_properties += sections
            if report.when == "teardown":
                report.user_properties += sections
    if report.when == "teardown":
        item.stash[_CELLS], item.stash[_NOT_PASSED] = [], False
    elif not report.passed:
        item.stash[_NOT_PASSED] = True
    return report


@pytest.fixture
def robolink_state(
    monkeypatch: pytest.MonkeyPatch, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Path]:
    """The folder in which robolink keeps journal, markers and backups during this test.

    It is the test's own, so that nothing is left in the developer's journal. A test that named
    one itself, through ROBOLINK_STATE_DIR or ROBOLINK_JOURNAL, keeps it.
    """
    now = {name: os.environ.get(name) for name in _STATE}
    folder = now["ROBOLINK_STATE_DIR"]
    if now == _OF_THE_DEVELOPER or folder is None:
        folder = str(tmp_path_factory.mktemp("robolink-state"))
        monkeypatch.setenv("ROBOLINK_STATE_DIR", folder)
    if now["ROBOLINK_JOURNAL"] == _OF_THE_DEVELOPER["ROBOLINK_JOURNAL"]:
        monkeypatch.delenv("ROBOLINK_JOURNAL", raising=False)
    if os.environ.get("ROBOLINK_PLANT") == _BEFORE.get("ROBOLINK_PLANT"):
        monkeypatch.setenv("ROBOLINK_PLANT", "")  # what a test records is copied nowhere
    yield Path(folder)
    if "robolink.journal" in sys.modules:
        from robolink.journal import close_files

        close_files()


@pytest.fixture
def robolink_journal(
    robolink_state: Path,  # noqa: ARG001 - the journal of the test, not the tester's
) -> "Journal":
    """The journal of this test, with what tests and commands did on its cells."""
    from robolink.journal import open_journal

    return open_journal()


@pytest.fixture
def virtual_clock(request: pytest.FixtureRequest) -> Iterator["ManualClock"]:
    """The time of the cells in the process: it passes only when somebody waits or steps it.

    A test all of whose cells are on a port has stepped the time of none: it fails.
    """
    from robolink_simulators.cell.clock import ManualClock

    clock = ManualClock()
    yield clock
    cells = request.node.stash.get(_CELLS, [])
    kept = not cells or any(cell.clock is clock for cell in cells)
    if not kept and not request.node.stash.get(_NOT_PASSED, False):
        pytest.fail(
            "No cell of this test keeps the time of virtual_clock: on a port, each has its own, "
            "which cell.do('step', seconds=2) steps.",
            pytrace=False,
        )


@pytest.fixture
def _robolink_own(
    request: pytest.FixtureRequest,
    robolink_state: Path,  # noqa: ARG001 - the state of the test, not the tester's
    tmp_path_factory: pytest.TempPathFactory,
) -> Iterator["OwnFolder"]:
    from robolink_simulators.testkit.served import OwnFolder

    cells = request.node.stash.setdefault(_CELLS, [])
    seed = request.config.getoption("--robolink-seed")
    with ExitStack() as stack:
        own = tmp_path_factory.mktemp("robolink-cell")
        yield OwnFolder(stack, own, seed, cells, _BEFORE)
    unplayed = [what for cell in cells for what in cell.operator.unplayed()]
    if unplayed and not request.node.stash.get(_NOT_PASSED, False):
        pytest.fail("\n".join(unplayed), pytrace=False)


@pytest.fixture
def epson_factory(request: pytest.FixtureRequest, _robolink_own: "OwnFolder") -> Factory:
    """A maker of EPSON controllers: ``epson_factory(medium="tcp", robot="C8-C901S")``."""
    from robolink_simulators.testkit.making import make_epson

    def make(*, medium: str = "sim", person: bool = False, **given: Any) -> "SimulatedCell":  # noqa: ANN401 - as the marker
        asked = _asked(request, "epson", given, medium)
        return make_epson(_robolink_own, asked, medium, _clock_of(request), person=person)

    return make


@pytest.fixture
def softmotion_factory(request: pytest.FixtureRequest, _robolink_own: "OwnFolder") -> Factory:
    """A maker of SoftMotion PLCs: ``softmotion_factory(medium="can", kinematics="Kin_5Axes")``."""
    from robolink_simulators.testkit.making import make_softmotion

    def make(*, medium: str = "sim", person: bool = False, **given: Any) -> "SimulatedCell":  # noqa: ANN401 - as the marker
        asked = _asked(request, "softmotion", given, medium)
        return make_softmotion(_robolink_own, asked, medium, _clock_of(request), person=person)

    return make


@pytest.fixture
def plc_factory(request: pytest.FixtureRequest, _robolink_own: "OwnFolder") -> Factory:
    """A maker of PLCs with a register map: ``plc_factory(map="machine.toml")``."""
    from robolink_simulators.testkit.making import make_plc

    def make(*, medium: str = "modbus-tcp", **given: Any) -> "SimulatedCell":  # noqa: ANN401 - as the marker
        asked = _asked(request, "plc", given, medium)
        return make_plc(_robolink_own, asked, medium, _clock_of(request))

    return make


@pytest.fixture
def serve_simulator(request: pytest.FixtureRequest, _robolink_own: "OwnFolder") -> Factory:
    """Serves a simulator of your own, furnished as you like: ``serve_simulator(EpsonSimulator())``.

    It takes ``medium``, ``clock``, and ``map_file`` for a PLC with a register map.
    """
    from robolink_simulators.testkit.making import serve_made

    def serve(
        simulator: Any,  # noqa: ANN401 - of any kind
        *,
        medium: str = "sim",
        clock: Any = None,  # noqa: ANN401 - stepped or steered
        map_file: Path | None = None,
    ) -> "SimulatedCell":
        time = clock or (_clock_of(request) if medium == "sim" else None)
        return serve_made(_robolink_own, simulator, medium, time, map_file)

    return serve


@pytest.fixture
def epson_sim(request: pytest.FixtureRequest, epson_factory: Factory) -> "SimulatedCell":
    """A simulated EPSON controller in this process, whose time passes only while you wait.

    Parametrize it indirectly for other ways to reach it: ``sim``, ``tcp``, ``serial``.
    """
    return epson_factory(medium=getattr(request, "param", "sim"))


@pytest.fixture
def epson_tcp(epson_factory: Factory, request: pytest.FixtureRequest) -> "SimulatedCell":
    """A simulated EPSON controller on a loopback TCP port, with its assist port, in real time.

    The marker's ``speed`` makes it faster.
    """
    marked = _asked(request, "epson", {}, "tcp").speed
    given = {} if marked is not None else {"speed": 1.0}
    return epson_factory(medium="tcp", person=True, **given)


@pytest.fixture
def softmotion_sim(request: pytest.FixtureRequest, softmotion_factory: Factory) -> "SimulatedCell":
    """A simulated SoftMotion PLC in this process.

    Parametrize it indirectly for other ways to reach it: ``sim``, ``modbus-tcp``,
    ``modbus-rtu`` (not on Windows), ``can``, ``opcua`` and ``opcua-secured``.
    """
    return softmotion_factory(medium=getattr(request, "param", "sim"))


@pytest.fixture
def plc_sim(request: pytest.FixtureRequest, plc_factory: Factory) -> "SimulatedCell":
    """A simulated PLC with a register map, on Modbus TCP.

    Parametrize it indirectly for other ways to reach it: ``sim``, ``modbus-rtu``; a map of symbols
    with ``opcua`` and ``opcua-secured``.
    """
    return plc_factory(medium=getattr(request, "param", "modbus-tcp"))


@pytest.fixture
def epson_cell(request: pytest.FixtureRequest, epson_factory: Factory) -> "SimulatedCell":
    """An EPSON cell on a TCP port, with a person, a pin, a recipe; ``serial`` by parametrizing."""
    return epson_factory(medium=getattr(request, "param", "tcp"), person=True)


@pytest.fixture
def softmotion_cell(request: pytest.FixtureRequest, softmotion_factory: Factory) -> "SimulatedCell":
    """A SoftMotion cell on Modbus TCP, with a person, a pin, a recipe; or another bus."""
    return softmotion_factory(medium=getattr(request, "param", "modbus-tcp"), person=True)


@pytest.fixture
def fault_plan() -> Callable[..., dict[str, object]]:
    """Plans faults at a cell: ``fault_plan(cell, "drop_reply", match="TLSet 2, XY", times=2)``.

    Returns what has happened and what waits; without an action it only tells that.
    """

    def plan(cell: "SimulatedCell", action: str = "", **given: object) -> dict[str, object]:
        return cell.do("add_fault", action=action, **given) if action else cell.do("faults")

    return plan


@pytest.fixture
def epson_replay(
    robolink_state: Path,  # noqa: ARG001 - the state of the test, not the tester's
) -> Iterator[Callable[[Path], str]]:
    """A maker of replays: give it a recording, connect to the URL that it returns.

    The test fails when a client asked otherwise than recorded, or did not connect as often.
    """
    from robolink_simulators.hosting.replay import ReplayDevice, read_recording, serve_replay

    devices: list[ReplayDevice] = []
    with ExitStack() as stack:

        def serve(recording: Path) -> str:
            device = ReplayDevice(read_recording(recording))
            devices.append(device)
            return stack.enter_context(serve_replay(device)).url

        yield serve
    differences = [what for device in devices for what in device.differences]
    differences += [
        f"{device.unplayed} recorded connections were not made"
        for device in devices
        if device.unplayed
    ]
    if differences:
        pytest.fail("\n".join(differences), pytrace=False)


def _seed(text: str) -> int:
    seed = int(text)
    if seed < 0:  # the generator gives the same values for -3 as for 3
        raise ValueError(text)
    return seed


def _asked(
    request: pytest.FixtureRequest, kind: str, given: dict[str, Any], medium: str
) -> "CellRequest":
    from robolink_simulators.testkit.making import (
        HEEDED,
        CellRequest,
        require_heeded,
        require_time_of_its_own,
    )

    asked: dict[str, Any] = {}
    of_test: dict[str, Any] = {}
    for node, marker in reversed(list(request.node.iter_markers_with_node(_MARKER))):
        if marker.args:
            raise pytest.UsageError("the marker robolink takes names: robolink(seed=3)")
        asked |= marker.kwargs
        # A module's or class's marker may be for the cells of its other tests.
        of_test |= marker.kwargs if node is request.node else {}
    wanted = CellRequest.of(asked | given)
    require_time_of_its_own(medium, given)
    require_heeded(given, (kind,))
    require_heeded(of_test, [it for it in HEEDED if f"{it}_factory" in request.fixturenames])
    return wanted


def _clock_of(request: pytest.FixtureRequest) -> "ManualClock | None":
    if "virtual_clock" not in request.fixturenames:
        return None
    clock: ManualClock = request.getfixturevalue("virtual_clock")
    return clock
