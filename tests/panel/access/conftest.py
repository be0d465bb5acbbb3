import pytest
from robolink_cli.panel.guard import people

from tests.panel.access._bare import Panel


@pytest.fixture(autouse=True)
def cheap_pins(monkeypatch):
    """PINs at a cost for tests; what the real one takes, test_pins.py looks at."""
    monkeypatch.setattr(people, "COST", 2)


@pytest.fixture
def panel(tmp_path):
    """A panel on loopback, with everybody's PIN."""
    made = Panel(tmp_path)
    made.set_pins()
    with made.served():
        yield made


@pytest.fixture
def far_panel(tmp_path):
    """A panel that believes to listen on the LAN, with names of its own and everybody's PIN.

    Its bytes go over loopback and without TLS, which the gate does not see to.
    """
    made = Panel(tmp_path, host="0.0.0.0", names=("cell.shop", "*.line.shop", "127.0.0.1"))
    made.set_pins()
    with made.served():
        yield made


@pytest.fixture
def state_folder(tmp_path, monkeypatch):
    """The test's own state folder and working folder; returns the first."""
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
    monkeypatch.chdir(tmp_path)
    return tmp_path / "state"
