"""What ``make wheelhouse`` gathers is enough for a PC that has no network."""

import json
import os
import shutil
import subprocess
import sys
import zipfile
from email.parser import HeaderParser
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name, parse_wheel_filename

import robolink

ROOT = Path(__file__).parents[2]

TARGETS = {
    "linux": {"sys_platform": "linux", "platform_system": "Linux", "os_name": "posix"},
    "win_amd64": {"sys_platform": "win32", "platform_system": "Windows", "os_name": "nt"},
}

pytestmark = [pytest.mark.soak, pytest.mark.timeout(180)]


def pip(*arguments):
    return subprocess.run(
        [sys.executable, "-m", "pip", *arguments],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )


@pytest.fixture(scope="module")
def wheelhouse(tmp_path_factory):
    """The folder that ``make wheelhouse`` fills, with this Python instead of the one of .venv."""
    if shutil.which("make") is None:
        pytest.skip("there is no make on this machine")
    folder = tmp_path_factory.mktemp("wheelhouse")
    probe = pip("download", "--quiet", "--no-deps", "--dest", str(folder / "probe"), "platformdirs")
    if probe.returncode:
        pytest.skip("the package index cannot be reached, so no wheels can be gathered")
    filled = folder / "wheels"
    done = subprocess.run(
        [
            *("make", "--old-file=.venv/.installed-dev", "wheelhouse"),
            *(f"WHEELHOUSE={filled}", f"BIN={Path(sys.executable).parent}"),
        ],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return filled


def metadata_of(wheel):
    with zipfile.ZipFile(wheel) as archive:
        (name,) = (n for n in archive.namelist() if n.endswith(".dist-info/METADATA"))
        return HeaderParser().parsestr(archive.read(name).decode())


@pytest.mark.parametrize("target", TARGETS)
def test_every_dependency_is_there_for_the_platform(wheelhouse, target):
    wheels = {}
    for path in (wheelhouse / target).iterdir():
        name, version, _, tags = parse_wheel_filename(path.name)
        wheels[name] = (version, path)
        assert any(tag.interpreter in {"py3", "cp311"} or tag.abi == "abi3" for tag in tags)
        platforms = {tag.platform for tag in tags}
        # pip takes wheels for older systems as well.
        linux = {f"manylinux{year}_x86_64" for year in ("1", "2010", "2014")}
        fits = {"win_amd64"} if target == "win_amd64" else linux
        assert platforms & {"any", *fits}, path.name
    assert str(wheels[canonicalize_name("robolink")][0]) == robolink.__version__
    environment = {"python_version": "3.11", "extra": "", **TARGETS[target]}
    for _, path in wheels.values():
        for line in metadata_of(path).get_all("Requires-Dist", []):
            wanted = Requirement(line)
            if wanted.marker is None or wanted.marker.evaluate(environment):
                found, _ = wheels[canonicalize_name(wanted.name)]
                assert found in wanted.specifier, f"{path.name} needs {line}"


def test_nothing_lies_beside_the_two_folders(wheelhouse):
    assert {path.name for path in wheelhouse.iterdir()} == set(TARGETS)


@pytest.mark.skipif(
    sys.platform != "linux" or sys.version_info[:2] != (3, 11),
    reason="the wheels of the linux folder are for Python 3.11 on Linux",
)
def test_a_clean_computer_installs_and_runs_it_without_an_index(wheelhouse, tmp_path):
    clean = {
        name: value
        for name, value in os.environ.items()
        if not name.startswith(("PIP_", "PYTHON", "ROBOLINK"))
    } | {
        "PIP_CONFIG_FILE": os.devnull,
        "PIP_NO_INDEX": "1",
        "PIP_DISABLE_PIP_VERSION_CHECK": "1",
        "ROBOLINK_STATE_DIR": str(tmp_path / "state"),
    }

    def run(*command):
        done = subprocess.run(
            command,
            cwd=tmp_path,
            env=clean,
            capture_output=True,
            text=True,
            timeout=90,
            check=False,
        )
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    folder = tmp_path / "venv"
    run(sys.executable, "-m", "venv", str(folder))
    python, program = str(folder / "bin" / "python"), str(folder / "bin" / "robolink")
    install = ("install", "--no-index", "--find-links", str(wheelhouse / "linux"), "--no-compile")
    run(python, "-m", "pip", *install, "robolink")
    run(python, "-m", "pip", "check")
    assert run(program, "--version") == f"robolink {robolink.__version__}\n"
    document = json.loads(run(program, "demo", "--speed", "20", "--json"))
    assert document["schema"] == "robolink/demo/2"
    assert document["controllers"][0]["verification"]["passed"]
    report = json.loads(run(program, "doctor", "--json"))
    assert report["healthy"], report
