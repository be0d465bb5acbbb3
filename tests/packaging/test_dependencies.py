"""Dependencies: bounds, hashes, and a wheelhouse for a PC without a network."""

import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from email.parser import HeaderParser
from importlib import metadata
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name, parse_wheel_filename
from packaging.version import Version

import robolink
from tests.versions._beneath import FAILING, REASONS
from tests.versions._declared import (
    ROOT,
    UNTRIED,
    lowest,
    project,
    pythons,
    run_time_dependencies,
    tried,
)
from tests.versions._runs import runs

# Each run-time dependency has a lowest and a highest version, and these are the tried ones.
# ``make versions`` runs robolink with them and writes the results into
# ``tests/versions/tried.json``.

IMPORT = re.compile(r"^ *(?:from (\w+)[\w.]* import |import (\w+)[\w.]*(?: as \w+)?$)", re.M)


def version_of(name):
    try:
        return Version(metadata.version(name))
    except metadata.PackageNotFoundError:
        return None


@pytest.mark.parametrize("requirement", run_time_dependencies(), ids=lambda wanted: wanted.name)
def test_a_dependency_has_both_bounds_and_what_is_installed_lies_between(requirement):
    assert sorted(part.operator for part in requirement.specifier) == ["<", ">="]
    assert lowest(requirement) in requirement.specifier
    assert "99999" not in requirement.specifier
    installed = version_of(requirement.name)
    if installed is None:
        pytest.skip(f"the optional {requirement.name} is not installed here")
    assert installed in requirement.specifier


def test_each_package_that_the_sources_import_is_a_dependency_or_an_extra():
    wanted = {requirement.name.replace("-", "_") for requirement in run_time_dependencies()}
    # Each release of pydantic requires one version of pydantic_core.
    packages = {"can": "python_can", "serial": "pyserial", "pydantic_core": "pydantic"}
    packages |= {"PIL": "pillow", "cv2": "opencv_python_headless", "paho": "paho_mqtt"}
    ours = {"robolink", "robolink_cli", "robolink_simulators", "pytest", "_typeshed"}
    # A clone compiles its catalogues with it; an installation has them compiled.
    ours.add("babel")
    imported = set()
    for part in ("robolink", "cli/robolink_cli", "simulators/robolink_simulators"):
        for path in (ROOT / part).rglob("*.py"):
            imported.update(IMPORT.findall(path.read_text(encoding="utf-8")))
    foreign = {one or other for one, other in imported} - set(sys.stdlib_module_names) - ours
    found = {packages.get(name, name) for name in foreign}
    assert found <= wanted
    assert {"click", "python_can", "platformdirs"} <= found


def test_the_lowest_versions_are_those_that_were_tried():
    (run,) = (found for name, found in tried().items() if name.startswith("lowest-"))
    wanted = {one.name: lowest(one) for one in run_time_dependencies()}
    assert {name: Version(run["versions"][name]) for name in wanted} == wanted
    assert run["versions"]["python"].startswith(f"{pythons()[0]}.")
    assert set(run["versions"]) == {"python", *wanted}


def test_each_python_of_the_classifiers_was_tried_with_versions_that_are_allowed():
    newest = {name: run for name, run in tried().items() if name.startswith("newest-")}
    assert {f"newest-{version}" for version in pythons()} <= newest.keys()
    assert newest.keys() <= {run.name for run in runs()}
    for name, run in newest.items():
        python = run["versions"]["python"]
        assert python.startswith(f"{name.removeprefix('newest-')}.")
        assert Version(python) in Requirement(f"python{project()['requires-python']}").specifier
        untried = {one.name for one in run_time_dependencies()} - run["versions"].keys()
        assert untried == UNTRIED.get(name, set()), name
        for wanted in run_time_dependencies():
            if wanted.name not in untried:
                assert run["versions"][wanted.name] in wanted.specifier, (name, wanted.name)


def test_for_each_dependency_it_is_known_why_it_is_not_lower():
    names = [wanted.name for wanted in run_time_dependencies()]
    assert sorted(names) == sorted([*FAILING, *REASONS])
    declared = {wanted.name: lowest(wanted) for wanted in run_time_dependencies()}
    for name, (version, _) in FAILING.items():
        run = tried()[f"beneath-{name}"]
        assert (run["version"], bool(run["failed"])) == (version, True)
        assert Version(version) < declared[name]


@pytest.mark.soak
@pytest.mark.timeout(1800)
def test_with_the_lowest_version_of_each_the_chosen_tests_pass(tmp_path):
    (run,) = (run for run in runs() if run.name.startswith("lowest-"))
    assert " passed" in run.carry_out(tmp_path / "venv")["tests"]


# Packages installed by hash, the statements about them, and that nothing else slips in.

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
    """A folder with one wheel, in which pip finds nothing else and installs nothing."""
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


# ---- statements about them


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


# The wheels that ``make wheelhouse`` gathers are enough for a PC without a network.

TARGETS = {
    "linux": {"sys_platform": "linux", "platform_system": "Linux", "os_name": "posix"},
    "win_amd64": {"sys_platform": "win32", "platform_system": "Windows", "os_name": "nt"},
}


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


@pytest.mark.soak
@pytest.mark.timeout(180)
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


@pytest.mark.soak
@pytest.mark.timeout(180)
def test_nothing_lies_beside_the_two_folders(wheelhouse):
    assert {path.name for path in wheelhouse.iterdir()} == set(TARGETS)


@pytest.mark.soak
@pytest.mark.timeout(180)
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
