"""docs and recipe: the pages and recipes shipped with robolink."""

import json
import re
from pathlib import Path

import pytest
from robolink_cli import main
from robolink_cli.commands.shipped.docs import page_lines
from robolink_cli.commands.shipped.recipe import PURPOSES, first_comment, models
from robolink_cli.console.tables import columns

from tests.contract._terminal import Terminal

ROOT = Path(__file__).parents[2]
RECIPES = sorted(path.stem for path in (ROOT / "examples" / "recipes").glob("*.toml"))


@pytest.fixture
def run(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)

    def ran(*arguments):
        code = main.run(arguments)
        shown = capsys.readouterr()
        return code, shown.out, shown.err

    return ran


def test_every_page_is_listed_with_its_title_once(run):
    code, out, _ = run("docs", "--json")
    pages = {page["name"]: page["title"] for page in json.loads(out)["pages"]}
    here = {path.stem for path in (ROOT / "docs").glob("*.md")}
    assert code == 0
    assert {name for name in here if not name.endswith(".zh")} <= set(pages)
    assert not [name for name in pages if name.endswith(".zh")]
    assert "reference/epson" in pages
    assert all(pages.values())


@pytest.mark.parametrize("name", ["accuracy", "accuracy.md", "docs/accuracy.md"])
def test_a_page_is_shown_as_it_stands(run, name):
    code, out, _ = run("docs", name)
    assert (code, out) == (0, (ROOT / "docs" / "accuracy.md").read_text(encoding="utf-8"))
    assert json.loads(run("docs", name, "--json")[1])["text"] == out
    assert Path(run("docs", name, "--path")[1].strip()) == ROOT / "docs" / "accuracy.md"


@pytest.mark.parametrize("name", ["technician.md", "technician.zh.md"])
def test_on_a_terminal_no_word_of_a_page_is_broken(name):
    page = (ROOT / "docs" / name).read_text(encoding="utf-8")
    shown = page_lines(page, 80)
    assert max(columns(line) for line in shown.split("\n")) <= 80
    assert "".join(shown.split()) == "".join(page.split())
    assert re.findall(r"[\w/.]{3,}", shown, re.ASCII) == re.findall(r"[\w/.]{3,}", page, re.ASCII)
    assert not re.search("[\u4e00-\u9fff] [\u4e00-\u9fff]", shown)


def test_a_page_on_a_terminal_keeps_its_lists_tables_and_code():
    page = (
        "# Head\n\nOne two three\nfour five.\n\n* first\n  goes on\n* second\n\n"
        "    a  b\n\n```sh\nx  y\nz\n```\n| a | b |"
    )
    shown = page_lines(page, 16).split("\n")
    assert shown == [
        *("# Head", "", "One two three", "four five.", "", "* first goes on", "* second", ""),
        *("    a  b", "", "```sh", "x  y", "z", "```", "| a | b |"),
    ]


def test_a_page_that_is_there_in_chinese_is_shown_so(run):
    code, out, _ = run("docs", "technician", "--lang", "zh")
    assert (code, out) == (0, (ROOT / "docs" / "technician.zh.md").read_text(encoding="utf-8"))
    assert run("docs", "technician")[1] != out
    assert run("docs", "accuracy", "--lang", "zh")[1].startswith("# Accuracy")


def test_a_page_that_is_nearly_called_so_is_proposed(run):
    code, _, err = run("docs", "recipies")
    assert code == 2
    assert "Did you mean recipes, recipe-keys?" in err


def test_recipes_are_listed_with_what_they_are_for(run):
    listed = {
        one["name"]: one["purpose"]
        for one in json.loads(run("recipe", "list", "--json")[1])["recipes"]
    }
    assert sorted(listed) == RECIPES
    assert all(listed.values())


@pytest.mark.parametrize("name", RECIPES)
def test_a_copy_of_each_recipe_is_right_and_knows_its_schema(run, tmp_path, name):
    assert run("recipe", "new", name)[0] == 0
    first, rest = (tmp_path / f"{name}.toml").read_text(encoding="utf-8").split("\n", 1)
    schema = re.fullmatch(r"#:schema file://(/.*)", first)
    assert schema is not None
    assert json.loads(Path(schema[1]).read_text(encoding="utf-8"))["title"]
    model = (ROOT / "examples" / "recipes" / f"{name}.toml").read_text(encoding="utf-8")
    # Except for the note that the numbers are not yours, it is the recipe to the letter.
    lines = [line.removesuffix("  # SIMULATED") for line in rest.split("\n")]
    own = [line for line in lines if not line.startswith('numbers = "simulated"')]
    assert len(own) == len(lines) - 1
    assert "\n".join(own) == model.split("\n", 1)[1]
    assert run("recipe", "check", f"{name}.toml")[0] == 0


def test_a_copy_writes_over_nothing(run, tmp_path):
    own = tmp_path / "own.toml"
    own.write_text("name = 1\n")
    assert run("recipe", "new", "scara-pin", "own.toml")[0] == 2
    assert own.read_text() == "name = 1\n"
    code, out, _ = run("recipe", "check", "own.toml")
    assert code == 2
    assert "schema" in out
    assert run("recipe", "new", "scara-pin", "own.toml", "--force")[0] == 0
    assert json.loads(run("recipe", "check", "own.toml", "--json")[1])["ok"]


# recipe list: the purpose of each recipe, in the person's language, no word cut.


def test_each_recipe_says_what_its_file_says():
    assert {name: first_comment(path) for name, path in models().items()} == PURPOSES


def test_a_person_reads_it_in_their_language_and_a_program_in_english(capsys):
    assert main.run(["--lang", "zh", "recipe", "list"]) == 0
    assert "水平多关节机器人、基准销和一个人。" in capsys.readouterr().out
    assert main.run(["--lang", "zh", "--json", "recipe", "list"]) == 0
    entries = json.loads(capsys.readouterr().out)["recipes"]
    assert {one["name"]: one["purpose"] for one in entries} == PURPOSES


def test_on_a_narrow_terminal_no_word_is_cut():
    import fcntl
    import struct
    import termios

    terminal = Terminal("recipe", "list")
    try:
        fcntl.ioctl(terminal.descriptor, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 60, 0, 0))
        assert terminal.end() == 0
    finally:
        terminal.close()
    lines = terminal.shown.splitlines()
    assert max(map(len, lines)) <= 60
    words = {word for text in PURPOSES.values() for word in text.split()}
    assert words <= set(" ".join(lines).split())
