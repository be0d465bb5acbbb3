"""Simulators with a plan of faults, in process and on a socket."""

from contextlib import contextmanager
from itertools import count

import pytest
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.hosting.in_process.epson import register, unregister
from robolink_simulators.hosting.streams.epson import serve_tcp

_names = count()


@pytest.fixture(autouse=True)
def _own_state_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))


@pytest.fixture(params=["sim", "tcp"])
def serve(request):
    """A maker of URLs for a simulator of the test's own."""

    @contextmanager
    def offered(simulator):
        if request.param == "sim":
            name = f"faults-{next(_names)}"
            register(name, simulator)
            try:
                yield f"epson+sim://{name}"
            finally:
                unregister(name)
        else:
            with serve_tcp(simulator, clock=ScaledClock(40.0)) as host:
                yield host.url

    return offered
