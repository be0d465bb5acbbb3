"""Each run-time dependency has a lowest and a highest version, and the lowest really serves."""

import os
import re
import subprocess
import sys
import tomllib
from importlib import metadata
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.version import Version

ROOT = Path(__file__).parents[2]

IMPORT = re.compile(r"^ *(?:from (\w+)[\w.]* import |import (\w+)[\w.]*(?: as \w+)?$)", re.M)

NEVER = ("dev", "docs")
"""Extras for people who work on robolink; nothing of them is needed to use it."""

CHOSEN = (
    "tests/contract/journal/test_journal_files.py",
    "tests/contract/journal/test_journal_databases.py",
    "tests/contract/test_epson_tools.py",
    "tests/contract/test_plc_map.py",
    "tests/contract/test_recalibrate.py",
    "tests/contract/test_sim_softmotion_hosts.py",
    "tests/contract/test_softmotion_tools.py",
    "tests/cli/test_cli_frame.py",
    "tests/cli/test_cli_output.py",
    "tests/cli/test_commands_bad_input.py",
    "tests/cli/test_completion.py",
    "tests/cli/test_doctor.py",
    "tests/cli/test_refusals_of_every_command.py",
    "tests/unit/test_config_files.py",
    "tests/unit/test_recipe_files.py",
    "tests/unit/test_sim_spel_expressions.py",
)
"""What uses each dependency: files, prompts, tables, grammars, buses, the database."""


def run_time_dependencies():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = project["optional-dependencies"]
    lines = [*project["dependencies"]]
    lines += [line for extra, wanted in extras.items() if extra not in NEVER for line in wanted]
    return [Requirement(line) for line in lines]


def lowest(requirement):
    (version,) = (part.version for part in requirement.specifier if part.operator == ">=")
    return Version(version)


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
    assert {"click", "python_can", "sqlalchemy"} <= found


@pytest.mark.soak
@pytest.mark.timeout(1800)
def test_with_the_lowest_version_of_each_the_chosen_tests_pass(tmp_path):
    python = str(tmp_path / "venv" / "bin" / "python")
    # In the folder of the sources, so that "python -m pytest" runs these; state and caches apart.
    environment = {
        name: value
        for name, value in os.environ.items()
        if not name.startswith(("ROBOLINK", "PYTEST", "PYTHONPATH"))
    } | {"ROBOLINK_STATE_DIR": str(tmp_path / "state"), "PYTHONDONTWRITEBYTECODE": "1"}

    def run(*command):
        done = subprocess.run(
            command,
            cwd=ROOT,
            env=environment,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=1500,
            check=False,
        )
        assert done.returncode == 0, done.stdout[-5000:] + done.stderr[-5000:]
        return done.stdout

    run(sys.executable, "-m", "venv", str(tmp_path / "venv"))
    pinned = [
        f"{wanted.name}{'[binary]' if wanted.extras else ''}=={lowest(wanted)}"
        for wanted in run_time_dependencies()
    ]
    tools = ["editables", "hatchling", "hypothesis", "pytest", "pytest-timeout"]
    run(python, "-m", "pip", "install", "--quiet", "--no-compile", *pinned, *tools)
    run(
        python,
        "-m",
        "pip",
        "install",
        "--quiet",
        "--no-deps",
        "--no-build-isolation",
        "-e",
        str(ROOT),
    )
    program = "import importlib.metadata as m, sys; print(*map(m.version, sys.argv[1:]))"
    names = [wanted.name for wanted in run_time_dependencies()]
    installed = run(python, "-c", program, *names).split()
    assert [Version(text) for text in installed] == [lowest(w) for w in run_time_dependencies()]
    run(python, "-m", "robolink_cli", "demo", "--speed", "20")
    shown = run(
        *(python, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "no:xdist"), *CHOSEN
    )
    assert " passed" in shown
    assert " failed" not in shown
