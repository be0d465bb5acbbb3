"""One panel of a few cells for each module, and the plant's database of each test."""

import os
from pathlib import Path

import pytest
from robolink_cli.panel.guard import line_gate, people

from robolink.fleet import FleetStore
from tests.panel.plant._served import LineComputer, PlantPanel, token_of

CELLS = ("line3-a", "line3-b", "line4-a")


@pytest.fixture(scope="module")
def served(tmp_path_factory):
    """A panel that is served, and asks whichever database a test names."""
    folder = tmp_path_factory.mktemp("home")
    before = Path.cwd()
    os.chdir(folder)
    lines = [f'[cells.{name}]\nurl = "epson+tcp://127.0.0.1:9"\n' for name in CELLS]
    Path("robolink.toml").write_text("".join(lines))
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ROBOLINK_STATE_DIR", str(folder / "state"))
        patch.setenv("ROBOLINK_CONFIG", str(folder / "robolink.toml"))
        patch.setenv("ROBOLINK_PLANT", str(folder / "none.db"))
        patch.setattr(people, "COST", 2)
        patch.setattr(line_gate, "JOBS_A_SECOND", 1e9)
        with PlantPanel().served(CELLS, groups={"line3": ("line3-*",)}) as made:
            yield made
    os.chdir(before)


@pytest.fixture
def home(served, tmp_path, monkeypatch):
    """The test's own folder, in which it works."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture(params=["sqlite", pytest.param("postgresql", marks=pytest.mark.soak)])
def location(request, home, monkeypatch):
    """Where the plant's database is, which is empty."""
    found = str(home / "plant.db")
    if request.param == "postgresql":
        found = request.getfixturevalue("server").empty_database()
    monkeypatch.setenv("ROBOLINK_PLANT", found)
    return found


@pytest.fixture
def panel(served, location):
    """That panel, which has heard of nothing yet."""
    served.kept.clear()
    served.forget()
    return served


@pytest.fixture
def line(panel):
    """A line computer that may order everything."""
    return LineComputer(panel.port, token_of())


@pytest.fixture
def store(location):
    """The plant's database, on a connection of the test's own."""
    with FleetStore(location) as made:
        yield made
