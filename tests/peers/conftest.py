"""Fixtures of all third-party judges: their own state folder, and compiled C programs."""

import subprocess
from pathlib import Path

import pytest

_SOURCES = Path(__file__).parent
_CC = ("cc", "-std=c11", "-D_DEFAULT_SOURCE", "-Wall", "-Wextra", "-Werror")


@pytest.fixture(autouse=True)
def _own_state_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))


@pytest.fixture(scope="session")
def programs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder with the C programs of this directory, compiled against libmodbus."""
    folder = tmp_path_factory.mktemp("programs")
    libmodbus = _output("pkg-config", "--cflags", "--libs", "libmodbus").split()
    for source in _SOURCES.glob("*.c"):
        _output(*_CC, "-o", str(folder / source.stem), str(source), *libmodbus, "-lm")
    return folder


def _output(*command: str) -> str:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        pytest.fail(f"{' '.join(command)}:\n{done.stderr}", pytrace=False)
    return done.stdout
