"""Both kinds of database of a plant, empty for each test, and a clock that a test moves."""

import os
import secrets
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from robolink.fleet import FleetStore
from tests.contract.journal._postgresql import Server, asked
from tests.fleet._moving_cells import MovingCells, moving_cells


class Wall:
    """A wall clock that stands still until it is moved."""

    def __init__(self) -> None:
        self.now = datetime(2026, 11, 30, 23, 0, tzinfo=UTC)

    def __call__(self) -> datetime:
        return self.now

    def go_on(self, **by: float) -> None:
        self.now += timedelta(**by)


@pytest.fixture
def wall() -> Wall:
    return Wall()


@pytest.fixture(params=["sqlite", pytest.param("postgresql", marks=pytest.mark.soak)])
def location(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    """The address of an empty database."""
    if request.param == "sqlite":
        return str(tmp_path / "plant.db")
    server: Server = request.getfixturevalue("server")
    asked(server.url(), "DROP SCHEMA IF EXISTS fleet CASCADE")
    return server.url()


@pytest.fixture(scope="session")
def engine_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The file of an engine that was started and stopped.

    To make its 30 tables takes as long as all else that an engine does at its start. Those of an
    agent in a process of its own make theirs.
    """
    from robolink.fleet.engine import Engine

    file = tmp_path_factory.mktemp("engine") / "jobs.db"
    engine = Engine(f"sqlite:///{file}", "plant", print, workers=1)
    engine.start()
    engine.stop(60.0)
    return file


@pytest.fixture
def open_store(location: str, wall: Wall) -> Iterator[Callable[[], FleetStore]]:
    """Opens the database on a connection of its own, as another process would."""
    opened: list[FleetStore] = []

    def open_it() -> FleetStore:
        opened.append(FleetStore(location, clock=wall))
        return opened[-1]

    yield open_it
    for store in opened:
        store.close()


@pytest.fixture
def store(open_store: Callable[[], FleetStore]) -> FleetStore:
    return open_store()


@pytest.fixture
def fresh_seed() -> int:
    """A seed that no run had; a failure shows it."""
    return secrets.randbelow(10**9)


@pytest.fixture
def server_of(request: pytest.FixtureRequest) -> Callable[[str], AbstractContextManager[None]]:
    """Takes the database of a location away during a block."""

    @contextmanager
    def away(location: str) -> Iterator[None]:
        if "://" in location:
            server: Server = request.getfixturevalue("server")
            server.stop()
            try:
                yield
            finally:
                server.start()
            return
        hidden = Path(location).with_suffix(".hidden")
        Path(location).rename(hidden)
        yield
        hidden.rename(location)

    return away


@pytest.fixture
def cells_of(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, location: str
) -> Iterator[Callable[..., MovingCells]]:
    """Serves the cells that are named, in the cell files of this computer."""
    for name in [name for name in os.environ if name.startswith("ROBOLINK")]:
        monkeypatch.delenv(name)
    monkeypatch.setenv("ROBOLINK_CONFIG", str(tmp_path / "robolink.toml"))
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
    monkeypatch.setenv("ROBOLINK_PLANT", location)
    with ExitStack() as stack:
        yield lambda *names: stack.enter_context(moving_cells(tmp_path, location, *names))


@pytest.fixture
def cells(cells_of: Callable[..., MovingCells]) -> MovingCells:
    """Two cells."""
    return cells_of("a", "b")
