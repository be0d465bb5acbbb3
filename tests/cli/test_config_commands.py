"""cell files, validate and show, with their messages about the cell files."""

import json
import re

import pytest
from robolink_cli import main

URL = "epson+tcp://192.0.2.1:5000"


@pytest.fixture(autouse=True)
def own_files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("platformdirs.user_config_path", lambda *a, **k: tmp_path / "user")
    monkeypatch.setattr("platformdirs.site_config_path", lambda *a, **k: tmp_path / "site")


@pytest.fixture
def cells(tmp_path):
    """Two cells in the working folder, one of them with a limit from the site's file."""
    (tmp_path / "site").mkdir()
    (tmp_path / "site" / "robolink.toml").write_text(f'[cells.a]\nurl = "{URL}"\nbox_mm = 80\n')
    (tmp_path / "robolink.toml").write_text(
        "[cells.a]\n"
        'robot = "T6-602S"\n'
        "remote_timeout_s = 30\n"
        'remote_timeout_confirmed_by = "K. Sato, 2026-05-04"\n'
        'notes = "needle 机"\n'
        f'[cells.b]\nurl = "{URL}1"\n',
        encoding="utf-8",
    )
    return tmp_path


def run(capsys, *arguments):
    code = main.run([*arguments, "--json"])
    return code, json.loads(capsys.readouterr().out)


def test_path_shows_each_place_and_whether_it_is_there(cells, capsys, monkeypatch):
    monkeypatch.setenv("ROBOLINK_CONFIG", str(cells / "named.toml"))
    code, document = run(capsys, "config", "path")
    assert code == 0
    assert document["schema"] == "robolink/config-path/1"
    assert [(file["source"], file["exists"]) for file in document["files"]] == [
        ("named", False),
        ("folder", True),
        ("user", False),
        ("site", True),
    ]
    assert main.run(["config", "path"]) == 0
    assert (
        f"{cells / 'robolink.toml'}\n    from the working folder: exists" in capsys.readouterr().out
    )


def test_nothing_to_check_is_not_right(capsys):
    code, document = run(capsys, "cell", "validate")
    assert (code, document["ok"], document["files"]) == (2, False, [])
    assert main.run(["cell", "validate"]) == 2
    assert "There is no cell file to check" in capsys.readouterr().out


def test_check_finds_all_right(cells, capsys):
    code, document = run(capsys, "config", "check")
    assert code == 0
    assert document["ok"]
    assert [file["problems"] for file in document["files"]] == [[], []]
    assert main.run(["config", "check"]) == 0
    assert f"{cells / 'robolink.toml'}: right" in capsys.readouterr().out


def test_check_tells_every_problem_of_every_file(cells, capsys):
    (cells / "user").mkdir()
    (cells / "user" / "robolink.toml").write_text("[cells.a]\nlift_mm = 0\nspeed_mm_s = 0\n")
    code, document = run(capsys, "config", "check")
    assert code == 2
    assert not document["ok"]
    wrong = [
        (file["path"], problem["where"])
        for file in document["files"]
        for problem in file["problems"]
    ]
    path = str(cells / "user" / "robolink.toml")
    assert wrong == [(path, "cells.a.speed_mm_s"), (path, "cells.a.lift_mm")]
    assert main.run(["config", "check"]) == 2
    shown = capsys.readouterr().out
    assert f"{path}: wrong\n    cells.a.speed_mm_s: must be at least 1\n" in shown


def test_check_tells_when_files_do_not_go_together(cells, capsys):
    (cells / "robolink.toml").write_text("[cells.c]\ntimeout_s = 1\n")
    code, document = run(capsys, "config", "check")
    assert code == 2
    assert "cells.c.url: is missing" in document["disagreement"]
    assert main.run(["config", "check"]) == 2
    assert "cells.c.url: is missing" in capsys.readouterr().out


def test_check_takes_one_file_that_is_in_use_nowhere(tmp_path, capsys):
    path = tmp_path / "draft.toml"
    path.write_text("cells = 3")
    assert main.run(["config", "check", str(path)]) == 2
    assert capsys.readouterr().out == f"{path}: wrong\n    cells: must be a table\n"
    path.unlink()
    assert main.run(["config", "check", str(path)]) == 2
    assert "cannot be read: No such file" in capsys.readouterr().out


def test_show_lists_the_cells(cells, capsys):
    assert main.run(["config", "show"]) == 0
    assert capsys.readouterr().out == f"a  {URL}  T6-602S\nb  {URL}1\n"
    code, document = run(capsys, "config", "show")
    assert (code, list(document["cells"])) == (0, ["a", "b"])


def test_show_says_where_each_value_came_from(cells, capsys, monkeypatch):
    monkeypatch.setenv("ROBOLINK_PASSWORD_FILE", "not shown: it is no option")
    site, folder = str(cells / "site" / "robolink.toml"), str(cells / "robolink.toml")
    code, document = run(capsys, "config", "show", "a", "--origin", "--remote-timeout", "20")
    assert code == 0
    assert document["values"] == {
        "url": URL,
        "robot": "T6-602S",
        "remote_timeout_s": 20,
        "remote_timeout_confirmed_by": "K. Sato, 2026-05-04",
        "box_mm": 80,
        "notes": "needle 机",
        "timeout_s": 3,
        "journal": str(cells / "state" / "journal.db"),
    }
    assert document["origins"] == {
        "url": site,
        "robot": folder,
        "remote_timeout_s": "--remote-timeout",
        "remote_timeout_confirmed_by": folder,
        "box_mm": site,
        "notes": folder,
        "timeout_s": "default",
        "journal": "ROBOLINK_STATE_DIR",
    }


def test_show_takes_the_cell_from_c_as_well(cells, capsys, monkeypatch):
    assert main.run(["-c", "a", "config", "show", "--origin"]) == 0
    shown = capsys.readouterr().out
    assert shown.startswith("[cells.a]\n")
    assert re.search(f"\n  box_mm +80 +{re.escape(str(cells / 'site' / 'robolink.toml'))}\n", shown)
    monkeypatch.setenv("ROBOLINK_CONTROLLER", "b")
    assert main.run(["config", "show"]) == 0
    shown = capsys.readouterr().out
    assert shown.startswith("[cells.b]\n")
    assert "The robot stays still: nobody has confirmed" in shown


@pytest.mark.parametrize("arguments", [["config", "show", "c"], ["-c", "c", "status"]])
def test_an_unknown_cell_is_a_usage_error_that_lists_the_known(cells, capsys, arguments):
    code, document = run(capsys, *arguments)
    assert code == 2
    assert document["error"]["what"] == "There is no cell 'c'."
    assert "a, b" in document["error"]["remedy"]


def test_list_names_each_cell_with_its_address(cells, capsys):
    code, document = run(capsys, "cell", "list")
    assert (code, document["schema"]) == (0, "robolink/cells/1")
    assert {name: cell["url"] for name, cell in document["cells"].items()} == {
        "a": URL,
        "b": f"{URL}1",
    }


def test_people_are_listed_with_their_roles_and_where_nobody_is_named(cells, capsys):
    file = cells / "robolink.toml"
    people = '[cells.b.people]\n"0417" = "operator"\nChen = "engineer"\n'
    file.write_text(file.read_text(encoding="utf-8") + people, encoding="utf-8")
    named = {"0417": "operator", "Chen": "engineer"}
    assert run(capsys, "cell", "people")[1]["cells"] == {"a": None, "b": named}
    assert run(capsys, "cell", "people", "b")[1]["cells"] == {"b": named}
    assert main.run(["cell", "people"]) == 0
    shown = capsys.readouterr().out.splitlines()
    assert shown == [
        "a: nobody is named, so everybody may do everything.",
        "b:",
        "  0417  operator",
        "  Chen  engineer",
    ]
