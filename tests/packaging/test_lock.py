"""What is installed by hash, what is said of it, and that nothing else slips in."""

import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from importlib import metadata
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from packaging.version import Version

ROOT = Path(__file__).parents[2]
LOCKS = ("requirements.lock", "requirements-dev.lock")
ENTRY = re.compile(
    r"^([a-z0-9-]+)==(\S+)(?: ; sys_platform == \"win32\")?((?: \\\n    --hash=\S+)+)$", re.M
)
HASH = re.compile(r"--hash=sha256:[0-9a-f]{64}")
FAMILIES = ("LGPL", "MIT", "BSD", "APACHE", "PSF", "MPL")


def pins(lock):
    text = (ROOT / lock).read_text(encoding="ascii")
    return {name: (Version(version), hashes) for name, version, hashes in ENTRY.findall(text)}


def wanted(lock):
    document = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    project = document["project"]
    lines = [*project["dependencies"]]
    if lock == "requirements-dev.lock":
        lines += project["optional-dependencies"]["dev"] + document["build-system"]["requires"]
    return [Requirement(line) for line in lines]


@pytest.mark.parametrize("lock", LOCKS)
def test_each_dependency_is_named_with_a_version_in_its_range_and_hashes(lock):
    found = pins(lock)
    for requirement in wanted(lock):
        version, _ = found[canonicalize_name(requirement.name)]
        assert version in requirement.specifier, f"{requirement}: run make lock"
    for _, hashes in found.values():
        assert all(map(HASH.fullmatch, hashes.replace("\\", "").split()))


@pytest.mark.parametrize("lock", LOCKS)
def test_a_lock_names_no_index_and_every_line_of_it_is_understood(lock):
    text = (ROOT / lock).read_text(encoding="ascii")
    assert "://" not in text
    assert "index" not in text
    left = [line for line in ENTRY.sub("", text).splitlines() if line and line[0] != "#"]
    assert left == []


def test_what_a_locked_package_needs_is_locked_too():
    found = pins("requirements-dev.lock")
    for name in found:
        try:
            needs = metadata.requires(name) or []
        except metadata.PackageNotFoundError:
            continue  # of Windows
        for requirement in map(Requirement, needs):
            if requirement.marker is None or requirement.marker.evaluate({"extra": ""}):
                version, _ = found[canonicalize_name(requirement.name)]
                installed = Version(metadata.version(name))
                assert version in requirement.specifier or installed != found[name][0]


def test_ci_installs_by_hash():
    script = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    assert 'export LOCKED="${LOCKED-yes}"' in script
    if shutil.which("make") is None:
        pytest.skip("there is no make on this machine")
    shown = subprocess.run(
        [*("make", "--dry-run", "--always-make", "LOCKED=yes"), ".venv/.installed-dev"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    assert "tools/install-locked" in shown
    assert "--editable '.[dev]'" not in shown
    assert "--require-hashes" in (ROOT / "tools" / "install-locked").read_text(encoding="utf-8")


# ---- a package index of one wheel

WHEEL = "robolink_tiny-1.0-py3-none-any.whl"


@pytest.fixture
def index(tmp_path):
    """A folder with one wheel, where pip finds nothing else and installs nothing."""
    about = "Metadata-Version: 2.1\nName: robolink-tiny\nVersion: 1.0\n"
    with zipfile.ZipFile(tmp_path / WHEEL, "w") as wheel:
        wheel.writestr("robolink_tiny-1.0.dist-info/METADATA", about)
        wheel.writestr(
            "robolink_tiny-1.0.dist-info/WHEEL", "Wheel-Version: 1.0\nTag: py3-none-any\n"
        )
        wheel.writestr("robolink_tiny-1.0.dist-info/RECORD", "")
    return tmp_path


HERE = f"{sys.version_info.major}.{sys.version_info.minor}"


def installed(index, pin, *, pythons=HERE, **variables):
    (index / "requirements-dev.lock").write_text(f"# Python {pythons}; linux; 64 bit.\n{pin}\n")
    clean = {name: value for name, value in os.environ.items() if not name.startswith("PIP_")}
    return subprocess.run(
        [str(ROOT / "tools" / "install-locked"), sys.executable],
        cwd=index,
        env={
            **clean,
            "PIP_CONFIG_FILE": os.devnull,
            "PIP_DISABLE_PIP_VERSION_CHECK": "1",
            "PIP_DRY_RUN": "1",
            "PIP_FIND_LINKS": str(index),
            "PIP_IGNORE_INSTALLED": "1",
            "PIP_NO_INDEX": "1",
            **variables,
        },
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )


linux = pytest.mark.skipif(
    sys.platform != "linux" or os.uname().machine != "x86_64", reason="the lock is for Linux here"
)


@linux
@pytest.mark.soak
def test_a_wheel_with_another_hash_ends_the_installation(index):
    done = installed(index, f"robolink-tiny==1.0 --hash=sha256:{'0' * 64}")
    assert done.returncode == 1
    assert "is not the one that requirements-dev.lock names" in done.stderr
    assert "by the ranges" not in done.stderr


@linux
@pytest.mark.soak
@pytest.mark.parametrize("variables", [{}, {"LOCKED": "only"}], ids=["yes", "only"])
def test_an_index_that_lacks_a_package_is_told_and_the_ranges_are_taken(index, variables):
    done = installed(index, f"robolink-absent==1.0 --hash=sha256:{'0' * 64}", **variables)
    assert done.returncode != 0  # there is no project in this folder that could be installed
    assert "does not have all that requirements-dev.lock names" in done.stderr
    assert ("by the ranges" in done.stderr) == (not variables)


@pytest.mark.soak
@pytest.mark.parametrize("pythons", [f"{HERE}1", "2.7, 3.0"])
def test_a_lock_for_other_pythons_is_told_and_the_ranges_are_taken(index, pythons):
    pin = f"robolink-tiny==1.0 --hash=sha256:{'0' * 64}"
    done = installed(index, pin, pythons=pythons)
    assert "is not for this Python or system" in done.stderr
    assert "by the ranges" in done.stderr
    done = installed(index, pin, pythons=pythons, LOCKED="only")
    assert (done.returncode, "by the ranges" in done.stderr) == (1, False)


# ---- what is said of it


@pytest.fixture(scope="module")
def said(tmp_path_factory):
    folder = tmp_path_factory.mktemp("dist")
    subprocess.run([sys.executable, str(ROOT / "tools" / "materials.py"), str(folder)], check=True)
    (bill,) = folder.glob("*.cdx.json")
    (licences,) = folder.glob("*.licences.txt")
    return json.loads(bill.read_text(encoding="ascii")), licences.read_text(encoding="utf-8")


def test_the_bill_of_materials_holds_all_that_runs_and_nothing_that_only_tests(said):
    document, licences = said
    assert (document["bomFormat"], document["specVersion"]) == ("CycloneDX", "1.6")
    parts = {part["name"]: part for part in document["components"]}
    assert {canonicalize_name(one.name) for one in wanted("requirements.lock")} <= set(parts)
    assert not {"pytest", "ruff", "hypothesis"} & set(parts)
    for name, part in parts.items():
        assert part["version"] == metadata.version(name)
        assert part["purl"] == f"pkg:pypi/{name}@{part['version']}"
        assert f"{name} " in licences
    known = {part["bom-ref"] for part in parts.values()}
    for entry in document["dependencies"]:
        assert set(entry["dependsOn"]) <= known


def test_the_licence_of_all_that_runs_is_the_one_that_the_notice_names(said):
    document, _ = said
    notice = (ROOT / "NOTICE").read_text(encoding="utf-8")
    rows = dict(re.findall(r"^ {0,2}([A-Za-z][\w-]+) +(\S.*?)(?:  .*|; brings)?$", notice, re.M))
    named = {canonicalize_name(name): licence.upper() for name, licence in rows.items()}
    for part in document["components"]:
        (licence,) = part["licenses"]
        text = (licence.get("expression") or licence["license"]["name"]).upper()
        assert part["name"] in named, f"NOTICE does not name {part['name']} ({text})"
        families = [family for family in FAMILIES if family in text]
        assert families, f"the licence of {part['name']} is not known: {text}"
        assert any(family in named[part["name"]] for family in families), part["name"]
        assert "GPL" not in text.replace("LGPL", ""), part["name"]
        assert "AFFERO" not in text
