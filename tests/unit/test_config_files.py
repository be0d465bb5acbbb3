"""Cell files: their places, their precedence, and their faults."""

import sys

import pytest

from robolink.config import (
    Source,
    cell_names,
    check_file,
    config_files,
    find_cell,
    group_names,
    load_cells,
    names_meant,
    reach_cell,
    remember_reach,
    select_cells,
)
from robolink.errors import ConfigError

URL = "epson+tcp://192.0.2.1:5000"
OTHER = "epson+tcp://192.0.2.2:5000"


@pytest.fixture(autouse=True)
def places(tmp_path, monkeypatch):
    """The four places of cell files, inside the test's own folder."""
    found = {
        "named": tmp_path / "named.toml",
        "folder": tmp_path / "work" / "robolink.toml",
        "user": tmp_path / "user" / "robolink" / "robolink.toml",
        "site": tmp_path / "site" / "robolink" / "robolink.toml",
    }
    for path in found.values():
        path.parent.mkdir(parents=True, exist_ok=True)
    monkeypatch.chdir(found["folder"].parent)
    for source in ("user", "site"):
        folder = found[source].parent
        monkeypatch.setattr(
            f"platformdirs.{source}_config_path", lambda name, appauthor, folder=folder: folder
        )
    monkeypatch.delenv("ROBOLINK_CONFIG", raising=False)
    return found


def problems(tmp_path, text):
    path = tmp_path / "wrong.toml"
    path.write_text(text, encoding="utf-8")
    return {problem.where: problem.what for problem in check_file(path)}


def test_the_places_stand_in_the_order_of_precedence(places, monkeypatch):
    assert [file.source for file in config_files()] == [Source.FOLDER, Source.USER, Source.SITE]
    monkeypatch.setenv("ROBOLINK_CONFIG", str(places["named"]))
    assert {file.source: file.path for file in config_files()} == places
    assert next(iter(config_files())).source is Source.NAMED


@pytest.mark.parametrize("count", [1, 2, 3, 4])
def test_each_value_comes_from_the_first_file_that_says_it(places, monkeypatch, count):
    monkeypatch.setenv("ROBOLINK_CONFIG", str(places["named"]))
    places["named"].touch()
    farthest_first = list(places)[::-1]
    for number, source in enumerate(farthest_first[:count]):
        url = f'url = "{URL}"\n' if source == "site" else ""
        places[source].write_text(f"[cells.a]\n{url}timeout_s = {number + 1}\n")
    cell = find_cell("a")
    assert cell.url == URL
    assert cell.settings.timeout_s == count
    assert cell.origins == {
        "url": places["site"],
        "timeout_s": places[farthest_first[count - 1]],
    }


def test_a_file_that_gives_a_url_starts_the_cell_anew(places):
    confirmed = 'remote_timeout_s = 60\nremote_timeout_confirmed_by = "K. Sato"\n'
    places["site"].write_text(f'[cells.a]\nurl = "{URL}"\nbox_mm = 400\n{confirmed}')
    places["user"].write_text(f'[cells.a]\nurl = "{OTHER}"\n')
    cell = find_cell("a")
    assert cell.url == OTHER
    assert cell.settings.box_mm is None
    assert cell.settings.remote_timeout_s is None


def test_a_cell_that_nobody_gave_a_url_is_told(places):
    places["user"].write_text("[cells.a]\ntimeout_s = 2\n")
    with pytest.raises(ConfigError, match=r"cells\.a\.url: is missing") as caught:
        load_cells()
    assert str(places["user"]) in caught.value.what


def test_values_that_are_wrong_only_together_are_told_by_path(places):
    places["site"].write_text(f'[cells.a]\nurl = "{URL}"\nclearance_mm = 5\n')
    places["user"].write_text("[cells.a]\nlift_mm = 4\n")
    with pytest.raises(ConfigError, match=r"cells\.a\.clearance_mm: must be smaller than lift_mm"):
        find_cell("a")


def test_an_unknown_cell_lists_the_known_ones(places):
    places["user"].write_text(f'[cells.b]\nurl = "{URL}"\n')
    places["folder"].write_text(f'[cells.a]\nurl = "{URL}"\n')
    with pytest.raises(ConfigError, match="no cell 'c'") as caught:
        find_cell("c")
    assert "a, b" in caught.value.remedy
    assert cell_names() == ["a", "b"]


def test_without_a_file_there_are_no_cells(places):
    assert load_cells() == {}
    assert cell_names() == []
    with pytest.raises(ConfigError) as caught:
        find_cell("a")
    assert "cell files" in caught.value.remedy


def test_a_file_that_was_named_must_be_there(places, monkeypatch):
    monkeypatch.setenv("ROBOLINK_CONFIG", str(places["named"]))
    with pytest.raises(ConfigError, match=r"named\.toml cannot be read: No such file"):
        load_cells()


def test_every_error_is_told_at_once_with_its_path_and_file(places):
    places["folder"].write_text(
        f'[cells.a]\nurl = "{URL}"\n'
        "[cells.line3]\n"
        'url = "192.168.0.1"\n'
        "robot = 3\n"
        'timeout_s = "3"\n'
        "speed_mm_s = true\n"
        "box_mm = nan\n"
        "remote_timeout_s = 0\n"
        "lift_mm = 200\n"
        "clearance_mm = 0.1\n"
        'password_env = "HOME"\n'
        'password_file = ""\n'
        "max_chagne_mm = 2\n"
        "[cells]\nb = 1\n"
    )
    with pytest.raises(ConfigError) as caught:
        load_cells()
    told = caught.value.what
    assert str(places["folder"]) in told
    for line in (
        "cells.line3.url: '192.168.0.1' is not a controller URL.",
        "cells.line3.robot: must be a text in quotes",
        "cells.line3.timeout_s: must be a number",
        "cells.line3.speed_mm_s: must be a number",
        "cells.line3.box_mm: must be a finite number",
        "cells.line3.remote_timeout_s: must be more than 0",
        "cells.line3.lift_mm: must be at most 100",
        "cells.line3.clearance_mm: must be at least 0.5",
        "cells.line3.password_env: must be the name of a variable that begins with ROBOLINK_",
        "cells.line3.password_file: must not be empty",
        "cells.line3.max_chagne_mm: is not known; did you mean max_change_mm?",
        "cells.b: must be a table",
    ):
        assert f"    {line}" in told
    assert "Nothing was sent" in caught.value.remedy


@pytest.mark.parametrize(
    "key", ["password", "passwd", "PWD", "passwort", "secret", "api_token", "pin"]
)
@pytest.mark.parametrize("table", ["", "[cells.a]\n"])
def test_a_key_that_looks_like_a_password_is_refused_and_not_repeated(tmp_path, table, key):
    found = problems(tmp_path, f'{table}{key} = "hunter2"\n')
    (what,) = found.values()
    assert "looks like a password, which a cell file must not contain" in what
    assert "hunter2" not in str(found)


def test_a_url_with_a_password_is_refused_and_not_repeated(tmp_path):
    found = problems(tmp_path, '[cells.a]\nurl = "epson+tcp://x:hunter2@192.0.2.1"\n')
    assert "must not carry" in found["cells.a.url"]
    assert "hunter2" not in str(found)


@pytest.mark.parametrize(
    ("lines", "where", "what"),
    [
        ("remote_timeout_s = 60", "remote_timeout_confirmed_by", "is missing: who saw"),
        (
            "remote_timeout_confirmed_by = 'me'",
            "remote_timeout_confirmed_by",
            "confirms nothing: remote_timeout_s is missing",
        ),
        ("lift_mm = 5\nclearance_mm = 5", "clearance_mm", "must be smaller than lift_mm"),
    ],
)
def test_what_belongs_together_is_checked_together(tmp_path, lines, where, what):
    found = problems(tmp_path, f"[cells.a]\n{lines}\n")
    assert list(found) == [f"cells.a.{where}"]
    assert found[f"cells.a.{where}"].startswith(what)


@pytest.mark.parametrize(
    ("stated", "what"),
    [
        ("99", "must be at least 100"),
        ("35001", "must be at most 35000"),
        ("150.5", "must be a whole number"),
        ("true", "must be a whole number"),
        ('"150"', "must be a whole number"),
    ],
)
def test_an_acceleration_is_a_whole_number_in_its_range(tmp_path, stated, what):
    lines = f'url = "{URL}"\nacceleration_mm_s2 = {stated}\n'
    assert problems(tmp_path, f"[cells.a]\n{lines}") == {"cells.a.acceleration_mm_s2": what}


def test_a_kind_that_robolink_does_not_move_keeps_to_no_acceleration(tmp_path, places):
    plc = 'url = "plc+modbus-tcp://192.0.2.3?map=machine.toml"\n'
    stated = "acceleration_mm_s2 = 150\n"
    (what,) = problems(tmp_path, f"[cells.a]\n{plc}{stated}").values()
    assert "robolink does not move controllers of this kind" in what
    # In two files, neither of which is wrong by itself.
    places["site"].write_text(f"[cells.a]\n{plc}")
    places["user"].write_text(f"[cells.a]\n{stated}")
    with pytest.raises(ConfigError, match=r"cells\.a\.acceleration_mm_s2: cannot apply"):
        find_cell("a")
    for url in (URL, "softmotion+modbus-tcp://192.0.2.3", "acme+usb://17"):
        places["site"].write_text(f'[cells.a]\nurl = "{url}"\n')
        assert find_cell("a").settings.acceleration_mm_s2 == 150


@pytest.mark.parametrize("name", ["a b", "epson+tcp", "a/b", "a:b", ""])
def test_a_name_that_could_be_a_url_is_no_cell(tmp_path, name):
    found = problems(tmp_path, f'[cells."{name}"]\nurl = "{URL}"\n')
    assert list(found) == [f'cells."{name}"']


def test_names_in_any_script_are_cells(places):
    places["folder"].write_text(f'[cells."三号线"]\nurl = "{URL}"\n', encoding="utf-8")
    assert find_cell("三号线").url == URL


@pytest.mark.parametrize(
    ("content", "cause"),
    [
        (b"[cells.a\n", "at line 1"),
        (b"\xff\xfe", "not UTF-8"),
        (b"a = " + b"[" * 100_000, "nested too deeply"),
    ],
    ids=["no TOML", "not text", "deep"],
)
def test_a_file_that_is_no_toml_is_told_and_tab_goes_on(places, content, cause):
    places["folder"].write_bytes(content)
    places["user"].write_text(f'[cells.a]\nurl = "{URL}"\n')
    with pytest.raises(ConfigError, match=cause) as caught:
        load_cells()
    assert str(places["folder"]) in caught.value.what
    assert cell_names() == ["a"]


def test_a_byte_order_mark_of_an_editor_does_not_matter(places):
    places["folder"].write_bytes(b"\xef\xbb\xbf" + f'[cells.a]\nurl = "{URL}"\n'.encode())
    assert find_cell("a").url == URL


def test_a_password_file_is_seen_from_the_cell_file(places, tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    places["user"].write_text(
        f'[cells.a]\nurl = "{URL}"\npassword_file = "secret"\n'
        f'[cells.b]\nurl = "{URL}"\npassword_file = "~/secret"\n'
    )
    assert find_cell("a").settings.password_file == str(places["user"].parent / "secret")
    assert find_cell("b").settings.password_file == str(tmp_path / "secret")


def test_names_for_tab_are_read_without_pydantic(places, monkeypatch):
    places["user"].write_text(f'[cells.a]\nurl = "{URL}"\n')
    monkeypatch.setitem(sys.modules, "pydantic", None)
    assert cell_names() == ["a"]


def test_a_stop_waits_as_usual_where_a_cell_says_nothing_of_it(places, monkeypatch):
    places["named"].write_text('[cells.a]\nurl = "epson+tcp://192.0.2.1:5000"\n')
    monkeypatch.setenv("ROBOLINK_CONFIG", str(places["named"]))
    assert (reach_cell("a").url, reach_cell("a").timeout_s) == ("epson+tcp://192.0.2.1:5000", 0.0)


def test_a_stop_takes_password_and_home_from_the_file_and_from_the_last_connection(
    places, monkeypatch
):
    monkeypatch.setenv("ROBOLINK_CONFIG", str(places["named"]))
    said = f'url = "{URL}"\npassword_file = "/s"\npassword_env = "PW"\nhome = "pc-1"\n'
    places["named"].write_text(f"[cells.a]\n{said}")
    for _ in range(2):
        reach = reach_cell("a")
        assert (reach.password_file, reach.password_env, reach.home) == ("/s", "PW", "pc-1")
        remember_reach("a", places["named"], reach)
        places["named"].write_text("[cells.a")  # damaged since
    assert reach.doubt


# Several cells at once: names, patterns, groups.

CELLS = ("line3-1", "line3-2", "glue-1", "line4-1", "@odd")
GROUPS = {"line3": ("line3-*",), "night": ("glue-?", "line3-2", "line3-[1-9]"), "gone": ("oven-1",)}


@pytest.mark.parametrize(
    ("words", "meant"),
    [
        (["glue-1", "line3-*"], ["glue-1", "line3-1", "line3-2"]),
        (["line*-1", "line3-1"], ["line3-1", "line4-1"]),
        (["@line3"], ["line3-1", "line3-2"]),
        (["@night", "line4-1"], ["glue-1", "line3-2", "line3-1", "line4-1"]),
        (["@odd"], ["@odd"]),
        (["*"], list(CELLS)),
    ],
)
def test_names_patterns_and_groups_name_each_cell_once_in_order(words, meant):
    assert list(names_meant(words, CELLS, GROUPS)) == meant


@pytest.mark.parametrize(
    ("words", "what", "remedy"),
    [
        (["line3-1", "line5"], "There is no cell 'line5'.", "line3-1"),
        (["oven-*"], "No cell has a name like 'oven-*'.", "glue-1"),
        (["@lime3"], "There is no group 'lime3' in the cell files.", "@line3"),
        (["@gone"], "Group gone: There is no cell 'oven-1'.", "glue-1"),
        (["LINE3-*"], "No cell has a name like 'LINE3-*'.", "line3-1"),
    ],
)
def test_a_word_that_names_no_cell_is_refused_by_name(words, what, remedy):
    with pytest.raises(ConfigError) as caught:
        names_meant(words, CELLS, GROUPS)
    assert caught.value.what == what
    assert remedy in caught.value.remedy


def test_the_nearer_group_of_a_name_counts_and_farther_groups_stay(places):
    two = f'[cells.a]\nurl = "{URL}"\n[cells.b]\nurl = "{OTHER}"\n'
    places["site"].write_text(f'[groups]\nnight = ["a"]\nall = ["*"]\n{two}')
    places["user"].write_text('[groups]\nnight = ["b"]\n')
    assert [cell.name for cell in select_cells(["@night"])] == ["b"]
    assert [cell.name for cell in select_cells(["@all"])] == ["a", "b"]
    assert [cell.name for cell in select_cells()] == ["a", "b"]
    assert group_names() == ["night", "all"]


def test_wrong_groups_are_told_by_their_key(tmp_path):
    text = 'groups."a b" = ["x"]\ngroups.c = []\ngroups.d = "line3-*"\ngroups.e = ["x", 3]\n'
    assert list(problems(tmp_path, text)) == ['groups."a b"', "groups.c", "groups.d", "groups.e.2"]
    assert "groups.@d" not in problems(tmp_path, 'groups.d = ["@c"]\n')
    told = problems(tmp_path, 'groups."@d" = ["x"]\n')
    assert "must not contain blanks" in told['groups."@d"']
    assert "groups" in problems(tmp_path, "group.c = ['x']\n")["group"]
