"""What is installed is what was meant to be, and nothing else."""

import configparser
import gettext
import io
import os
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest
from robolink_cli import main

import robolink

ROOT = Path(__file__).parents[2]
PACKAGES = {
    "robolink": ROOT / "robolink",
    "robolink_cli": ROOT / "cli" / "robolink_cli",
    "robolink_simulators": ROOT / "simulators" / "robolink_simulators",
}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheel")
    done = subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=50,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    (path,) = folder.iterdir()
    with zipfile.ZipFile(path) as archive:
        yield archive


@pytest.fixture(scope="module")
def names(wheel):
    return set(wheel.namelist())


def test_the_wheel_brings_three_packages_and_nothing_else(names):
    tops = {name.partition("/")[0] for name in names}
    assert tops == {*PACKAGES, f"robolink-{robolink.__version__}.dist-info"}


@pytest.mark.parametrize("package", PACKAGES)
def test_every_source_and_data_file_is_in_the_wheel(names, package):
    folder = PACKAGES[package]
    files = {
        f"{package}/{path.relative_to(folder).as_posix()}"
        for path in folder.rglob("*")
        if path.is_file() and "__pycache__" not in path.parts and path.suffix != ".po"
    }
    assert f"{package}/py.typed" in files
    assert files - names == set()


def test_the_wheel_brings_grammar_and_catalogue(names):
    assert any(name.endswith("/grammar.lark") for name in names)
    assert "robolink/locale/robolink.pot" in names


def test_the_wheel_brings_the_chinese_sentences_as_gettext_reads_them(wheel, names):
    folder = "robolink/locale/zh_CN/LC_MESSAGES"
    assert not any(name.endswith(".po") for name in names)
    for name, english in (("robolink", "Stop every motion now"), ("click", "Usage:")):
        translations = gettext.GNUTranslations(io.BytesIO(wheel.read(f"{folder}/{name}.mo")))
        assert translations.gettext(english) != english


def test_the_wheel_brings_the_programs_for_controllers_and_their_licence(wheel, names):
    folder = ROOT / "companions"
    for path in folder.rglob("*"):
        if path.is_file():
            name = f"robolink_cli/companions/{path.relative_to(folder).as_posix()}"
            assert wheel.read(name) == path.read_bytes()
    assert "robolink_cli/companions/LICENSE" in names


def test_the_wheel_brings_the_pages_and_the_recipes_to_begin_with(wheel, names):
    shipped = {
        f"robolink_cli/docs/{path.relative_to(ROOT / 'docs').as_posix()}": path
        for pattern in ("*.md", "reference/*.md", "pictures/*.svg")
        for path in (ROOT / "docs").glob(pattern)
    }
    shipped |= {
        f"robolink_cli/recipes/{path.name}": path
        for path in (ROOT / "examples" / "recipes").glob("*.toml")
    }
    assert len(shipped) > 60
    assert {
        name for name, path in shipped.items() if wheel.read(name) != path.read_bytes()
    } == set()
    assert not [name for name in names if name.startswith("robolink_cli/docs/site")]


def test_the_wheel_installs_the_command_and_the_simulator(wheel, names):
    (path,) = (name for name in names if name.endswith(".dist-info/entry_points.txt"))
    entries = configparser.ConfigParser(delimiters=("=",))
    entries.read_string(wheel.read(path).decode())
    assert dict(entries["console_scripts"]) == {"robolink": "robolink_cli.entry:main"}
    assert "epson+sim" in entries["robolink.transports"]
    assert callable(main.main)


def test_licence_and_notice_travel_along(names):
    (licence,) = (name for name in names if name.endswith("licenses/LICENSE"))
    assert licence.replace("LICENSE", "NOTICE") in names


def test_the_notice_names_every_run_time_dependency():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    notice = (ROOT / "NOTICE").read_text().lower()
    wanted = [*project["dependencies"], *project["optional-dependencies"]["keyring"]]
    for requirement in wanted:
        name = requirement.partition(">")[0]
        assert f"\n{name} " in notice, f"{name} is missing in NOTICE"


def test_versions_agree():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert project["version"] == robolink.__version__
    assert f"## [{robolink.__version__}]" in (ROOT / "CHANGELOG.md").read_text()


@pytest.mark.parametrize("folder", ["cli", "simulators"])
def test_no_second_name_leads_to_the_same_code(folder):
    assert not (ROOT / folder / "__init__.py").exists()


def test_ci_runs_what_a_person_runs():
    script = ROOT / ".ci" / "run"
    assert os.access(script, os.X_OK)
    assert script.read_text().rstrip().endswith("exec make test")
