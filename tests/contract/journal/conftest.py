"""Fixtures for both kinds of database that keep a journal, empty for each test."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from robolink.journal._journal import Journal
from robolink.journal._places import place_of
from robolink.journal.store.store import Store
from tests.contract.journal._postgresql import Server, asked

Opener = Callable[..., Journal]

ONE_DATABASE = pytest.mark.parametrize(
    "location",
    ["sqlite", pytest.param("postgresql", marks=pytest.mark.soak)],
    indirect=True,
)
"""For what the two could not do differently: the rows that the other tests read are the same."""


@pytest.fixture(params=["sqlite", "postgresql"])
def location(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    """The address of an empty database."""
    if request.param == "sqlite":
        return str(tmp_path / "journal.db")
    server: Server = request.getfixturevalue("server")
    return server.empty_place()


@pytest.fixture
def open_anew() -> Iterator[Opener]:
    """Opens a journal on its own connection, as another process would."""
    opened: list[Store] = []

    def open_it(location: str, *, read_only: bool = False) -> Journal:
        place = place_of(location)
        store = Store(place, read_only=read_only)
        opened.append(store)
        store.open()
        return Journal(store, place.location, read_only=read_only)

    yield open_it
    for store in opened:
        store.close()


@pytest.fixture
def journal(location: str, open_anew: Opener) -> Journal:
    """A new journal."""
    return open_anew(location)


@pytest.fixture(scope="session")
def plant_database(server: Server) -> str:
    """The URL of the one database in which each test of copies has a plant."""
    return server.empty_database()


@pytest.fixture
def plant(plant_database: str) -> str:
    """The URL of a plant's database that holds nothing; the first of these tests has made it."""
    if asked(plant_database, "SELECT to_regclass('fleet.cell_heads')") != [(None,)]:
        # To remove the tables and make them anew takes three times as long as most tests.
        asked(plant_database, "DELETE FROM fleet.cell_entries; DELETE FROM fleet.cell_heads")
    return plant_database
