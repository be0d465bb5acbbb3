"""Each run-time dependency has a lowest and a highest version, and these are what was tried.

``make versions`` runs robolink with them and writes what it saw into ``tests/versions/tried.json``.
"""

import re
import sys
from importlib import metadata

import pytest
from packaging.requirements import Requirement
from packaging.version import Version

from tests.versions._beneath import FAILING, REASONS
from tests.versions._declared import ROOT, lowest, project, pythons, run_time_dependencies, tried
from tests.versions._runs import runs

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
    # pydantic_core comes with pydantic, each release of which asks for one of its versions.
    packages = {"can": "python_can", "serial": "pyserial", "pydantic_core": "pydantic"}
    ours = {"robolink", "robolink_cli", "robolink_simulators", "pytest", "_typeshed"}
    # A clone compiles its catalogues with it; what is installed brings them compiled.
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
        for wanted in run_time_dependencies():
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
