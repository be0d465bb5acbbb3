"""Simulators with a plan of faults, in process and on a socket."""

import pytest
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.testkit.media import served


@pytest.fixture(autouse=True)
def _own_state_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))


@pytest.fixture(params=["sim", "tcp"])
def serve(request):
    """Makes URLs for a test's own simulators."""

    clock = None if request.param == "sim" else ScaledClock(40.0)
    return lambda simulator: served(simulator, request.param, clock=clock)
