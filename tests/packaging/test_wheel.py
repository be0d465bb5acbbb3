"""The wheel contains the intended files, and an integrator needs nothing else."""

import configparser
import gettext
import io
import os
import posixpath
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from email.parser import HeaderParser
from pathlib import Path

import pytest
from robolink_cli import main
from robolink_cli.commands.shipped.shipped_files import pages_folder, recipe_schema

import robolink
from tools.package_page import package_page, urls

# The installation contains the intended files, and nothing else.

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


@pytest.fixture(scope="module")
def description(wheel, names):
    (path,) = (name for name in names if name.endswith(".dist-info/METADATA"))
    return wheel.read(path).decode().partition("\n\n")[2]


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
    for name, english in (("robolink", "Stop the robot now"), ("click", "Usage:")):
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
        for pattern in ("*.md", "*.json", "reference/*.md", "decisions/*.md", "pictures/*.svg")
        for path in (ROOT / "docs").glob(pattern)
    }
    shipped |= {
        f"robolink_cli/recipes/{path.name}": path
        for path in (ROOT / "examples" / "recipes").glob("*.toml")
    }
    schema = recipe_schema().relative_to(pages_folder())  # where `recipe new` looks for it
    shipped[f"robolink_cli/docs/{schema.as_posix()}"] = ROOT / "docs" / "recipe.schema.json"
    assert len(shipped) > 60
    assert {
        name for name, path in shipped.items() if wheel.read(name) != path.read_bytes()
    } == set()
    assert not [name for name in names if name.startswith("robolink_cli/docs/site")]


def test_a_link_of_a_shipped_page_leads_to_a_file_of_the_wheel(wheel, names):
    pages = [name for name in names if name.startswith("robolink_cli/") and name.endswith(".md")]
    lost = [
        f"{page}: {target}"
        for page in pages
        for target in re.findall(r"\]\((?!https?://|#)([^)#\s]+)", wheel.read(page).decode())
        if posixpath.normpath(posixpath.join(posixpath.dirname(page), target)) not in names
    ]
    assert len(pages) > 80
    assert lost == []


def test_the_page_of_the_package_has_no_link_that_leads_nowhere(description):
    assert re.findall(r"\]\((?!https?://|#)[^)]*\)", description) == []
    commands = re.findall(r"`robolink docs ([\w/-]+)`", description)
    assert len(commands) > 15
    assert [name for name in commands if not (ROOT / "docs" / f"{name}.md").is_file()] == []


def test_a_published_package_links_to_where_its_files_are_and_names_its_home():
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    base = "https://example.org/robolink/blob/v1"
    page = package_page(readme, f"{base}/")
    links = re.findall(r"\]\(([^)]*)\)", page)
    assert len(links) > 20
    assert {link[: len(base) + 1] for link in links if "example" in link} == {f"{base}/"}
    assert all(link.startswith("https://") for link in links)
    assert all(
        (ROOT / link.removeprefix(f"{base}/").partition("#")[0]).exists()
        for link in links
        if link.startswith(base)
    )
    assert urls("", "") == {}
    assert urls("https://example.org", base)["Changelog"] == f"{base}/CHANGELOG.md"
    with pytest.raises(ValueError, match="https://"):
        package_page(readme, "example.org")


def test_the_metadata_say_what_an_index_sorts_by(wheel, names):
    (path,) = (name for name in names if name.endswith(".dist-info/METADATA"))
    found = HeaderParser().parsestr(wheel.read(path).decode())
    assert found["License-Expression"] == "Apache-2.0 AND 0BSD"
    assert set(found.get_all("License-File", [])) == {"LICENSE", "NOTICE", "companions/LICENSE"}
    classifiers = found.get_all("Classifier", [])
    assert len(classifiers) > 10
    assert not [line for line in classifiers if line.startswith("License ::")]
    assert found["Description-Content-Type"] == "text/markdown"


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
    assert script.read_text().rstrip().endswith("make panel\nexec make test")


# An integrator's project, outside this one, with the wheel and nothing else.

PROJECT = ROOT / "tests" / "integrator"


@pytest.mark.soak
def test_the_tests_of_an_integrator_pass_with_the_wheel(tmp_path):
    def run(*command, **more):
        environment = {
            name: value
            for name, value in os.environ.items()
            if name != "PYTHONPATH" and not name.startswith(("PYTEST", "ROBOLINK"))
        }
        done = subprocess.run(
            command, env=environment, capture_output=True, text=True, check=False, **more
        )
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    build = (sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(tmp_path))
    run(*build, cwd=ROOT)
    (wheel,) = tmp_path.glob("robolink-*.whl")
    run(sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-compile",
        "--target", str(tmp_path / "installed"), str(wheel))  # fmt: skip
    project = tmp_path / "project"
    shutil.copytree(PROJECT, project)
    # The packages that robolink needs come from here; robolink itself comes first, from the wheel.
    boot = (
        f"import sys; sys.path.insert(0, {str(tmp_path / 'installed')!r});"
        "import robolink, pytest; print('robolink is', robolink.__file__);"
        "sys.exit(pytest.main(['-q', '-p', 'no:cacheprovider', '--strict-markers', '-n', '2']))"
    )
    shown = run(sys.executable, "-c", boot, cwd=project)
    assert f"robolink is {tmp_path}" in shown
    assert "15 passed" in shown
