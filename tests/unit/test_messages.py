"""Sentences: one function for all, in the words of the program, its language and its local time."""

import os
import pickle
import re
import time
from pathlib import Path

import pytest
from robolink_cli.console.language import _of_user, chosen_language
from robolink_cli.console.shell_words import SHELL_WAYS

from robolink import messages
from robolink.controllers import advise_emergency_stop
from robolink.controllers.tool_table import require_replacement
from robolink.errors import ConnectError, SelectedToolError
from robolink.journal.store.chain import canonical, storable
from robolink.journal.store.failures import damaged_error, journal_error
from robolink.locale import languages
from robolink.messages import joined, plain, spoken, tr
from robolink.pose_tables.values import OpenQuestion, unclear
from robolink.remedy_words import RemedyWord, remedy_word, speaking
from robolink.timing import local_label
from tests._rows import each_row

# Every sentence goes through one function.

ROOT = Path(__file__).parents[2]


@pytest.fixture
def shouted():
    messages.install(str.upper)
    yield
    messages.install(None)


def test_a_sentence_is_shown_as_it_stands_without_a_translation():
    assert tr("The tip moved {distance_mm:.3f} mm.", distance_mm=0.25) == "The tip moved 0.250 mm."


def test_braces_without_values_are_left_alone():
    assert tr('Write {"a": 1}.') == 'Write {"a": 1}.'


def test_a_translation_is_asked_for_the_sentence_before_it_is_filled(shouted):
    assert tr("Connect again.") == "CONNECT AGAIN."


# A sentence of the library names the next step in the words of the program that shows it.


def test_the_shell_has_a_word_for_every_way():
    ways = [text for name, text in vars(RemedyWord).items() if name.isupper()]
    assert len(set(ways)) == len(ways) > 30
    assert set(SHELL_WAYS) == set(ways)


def test_each_program_says_it_in_its_own_words():
    with pytest.raises(SelectedToolError, match=r"then_select=NUMBER, 0 for the flange"):
        require_replacement(3, None)
    with (
        speaking(SHELL_WAYS),
        pytest.raises(SelectedToolError, match=r"--then-select NUMBER, 0 for the flange"),
    ):
        require_replacement(3, None)
    assert remedy_word(RemedyWord.RECORD) == "trace"


# The language of a name, the source of sentences, and the part of them that a record keeps.


@pytest.fixture
def marked():
    messages.install(lambda sentence: f"<{sentence}>")
    yield
    messages.install(None)


@each_row(
    ("name", "language"),
    [
        *[(name, "zh") for name in ("zh", "zh_CN", "zh-Hans", "Chinese_China.936", "ZH_cn.GBK")],
        *[(name, "en") for name in ("en", "en_US.UTF-8", "C", "C.UTF-8", "POSIX", "English_US")],
        *[(name, None) for name in ("", "de_DE", "zh_TW", "zh-Hant", "Chinese_Taiwan.950", "xzh")],
    ],
)
def test_a_language_is_known_by_each_of_its_names(name, language):
    assert languages.language_named(name) == language


@pytest.mark.parametrize(
    ("arguments", "environment", "language"),
    [
        (["--lang", "zh", "status"], {"ROBOLINK_LANG": "en"}, "zh"),
        (["status", "--lang=zh"], {}, "zh"),
        (["--lang", "zh", "status", "--lang", "en"], {}, "en"),
        (["--", "--lang", "zh"], {}, "en"),
        ([], {"ROBOLINK_LANG": "zh", "LC_ALL": "en_US.UTF-8"}, "zh"),
        ([], {"ROBOLINK_LANG": "tlh", "LANG": "zh_CN.UTF-8"}, "en"),
        ([], {"LC_ALL": "C", "LANG": "zh_CN.UTF-8"}, "en"),
        ([], {"LC_ALL": "", "LC_MESSAGES": "zh_CN", "LANG": "en_US"}, "zh"),
        ([], {"LANGUAGE": "zh_CN:en", "LANG": "en_US.UTF-8"}, "zh"),
        ([], {"LANGUAGE": "de:en:zh", "LC_ALL": "zh_CN.UTF-8"}, "en"),
        ([], {"LANGUAGE": "de", "LANG": "zh_CN.UTF-8"}, "zh"),
        ([], {"LANGUAGE": "zh", "LANG": "C.UTF-8"}, "en"),
        ([], {"LANGUAGE": "zh"}, "en"),
        ([], {"LANGUAGE": "zh", "LANG": "en_US", "ROBOLINK_LANG": "en"}, "en"),
        ([], {"LANG": "zh_CN.GBK"}, "zh"),
        (["status", "--json", "--lang", "zh"], {}, "en"),
        (["recalibrate", "r.toml", "--jsonl"], {"LANG": "zh_CN"}, "en"),
    ],
)
def test_the_language_comes_from_the_line_then_its_variable_then_the_system(
    arguments, environment, language, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    here = {"HOME": str(tmp_path), "XDG_CONFIG_HOME": str(tmp_path)}
    assert chosen_language(arguments, {**here, **environment}) == language


def test_a_cell_file_comes_before_the_users_and_both_before_the_system(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    environment = {"XDG_CONFIG_HOME": str(tmp_path / "home"), "LANG": "en_US.UTF-8"}
    own = tmp_path / "home" / "robolink" / "robolink.toml"
    own.parent.mkdir(parents=True)
    own.write_text('language = "zh"\n')
    assert chosen_language([], environment) == "zh"
    (tmp_path / "robolink.toml").write_text('[cells.a]\nnotes = "language = zh"\n')
    assert chosen_language([], environment) == "zh"
    (tmp_path / "robolink.toml").write_text('language = "en"\n')
    assert chosen_language([], environment) == "en"
    (tmp_path / "robolink.toml").write_text("language = ]")  # reported where the file is needed
    assert chosen_language([], environment) == "zh"
    assert chosen_language([], {**environment, "ROBOLINK_LANG": "en"}) == "en"


@pytest.mark.skipif(os.name == "nt", reason="the folder of Windows comes from its registry")
def test_the_users_file_is_where_platformdirs_says(tmp_path, monkeypatch):
    from robolink.config import Source, config_files

    for value in (str(tmp_path), ""):
        monkeypatch.setenv("XDG_CONFIG_HOME", value)
        (user,) = (file.path for file in config_files() if file.source is Source.USER)
        assert _of_user(os.environ) == str(user)


def test_a_record_keeps_the_english_of_what_a_person_was_shown(marked):
    said = tr("Tool {tool} was written.", tool=tr("of before"))
    assert said == "<Tool <of before> was written.>"
    assert storable(said) == "Tool of before was written."
    both = joined(" ", (said, tr("Nothing moved.")))
    assert both == "<Tool <of before> was written.> <Nothing moved.>"
    assert storable(both) == "Tool of before was written. Nothing moved."
    assert canonical(plain({"why": [said, 1.5], "also": (both,)})) == (
        '{"also":["Tool of before was written. Nothing moved."],'
        '"why":["Tool of before was written.",1.5]}'
    )
    assert storable(pickle.loads(pickle.dumps(said))) == storable(said)


def test_no_blank_stands_behind_a_chinese_full_stop():
    messages.install({"Moved.": "\u79fb\u52a8\u3002", "Written.": "\u5199\u5165\u3002"}.__getitem__)
    try:
        both = joined(" ", (tr("Moved."), tr("Written.")))
    finally:
        messages.install(None)
    assert both == "\u79fb\u52a8\u3002\u5199\u5165\u3002"
    assert storable(both) == "Moved. Written."
    assert joined(" ", ("", "Moved.")) == " Moved."


@each_row(
    "joins",
    [
        lambda: advise_emergency_stop(ConnectError("No answer.", remedy=tr("Check it."))),
        lambda: journal_error(PermissionError("it is read-only"), "a", tr("Nothing was sent.")),
        lambda: damaged_error("a page is bent", "a", tr("Nothing was sent.")),
        lambda: unclear(Path("a"), [OpenQuestion("deg", "turn", tr("Which?"))] * 2),
    ],
)
def test_a_remedy_of_several_sentences_is_kept_in_english_and_has_no_blank_in_chinese(joins):
    messages.install(lambda sentence: f"{'{export}' * ('{e' in sentence)}\u79fb\u3002")
    try:
        remedy = joins().remedy
    finally:
        messages.install(None)
    assert remedy.endswith("\u79fb\u3002")
    assert "\u3002 " not in remedy
    assert storable(remedy) == joins().remedy


def test_a_translation_with_a_wrong_placeholder_leaves_the_english_sentence():
    messages.install(lambda sentence: "{wrong} mm")
    try:
        assert tr("{distance_mm:.1f} mm", distance_mm=2.0) == "2.0 mm"
    finally:
        messages.install(None)


def test_what_was_declared_earlier_is_translated_when_it_is_shown(marked):
    declared = messages.declared("Name of the pin.")
    assert declared == "Name of the pin."
    assert spoken(declared) == "<Name of the pin.>"
    assert spoken("") == ""


def test_a_catalogue_is_compiled_again_when_its_source_changed(tmp_path, monkeypatch):
    folder = tmp_path / "zh_CN" / "LC_MESSAGES"
    folder.mkdir(parents=True)
    source = folder / "robolink.po"
    head = 'msgid ""\nmsgstr "Content-Type: text/plain; charset=utf-8\\n"\n\n'
    monkeypatch.setattr(languages, "FOLDER", str(tmp_path))

    def said():
        translate = languages.translator("zh")
        assert translate is not None
        return translate("Stop.")

    source.write_text(head + 'msgid "Stop."\nmsgstr "停止"\n', encoding="utf-8")
    assert said() == "停止"
    assert (folder / "robolink.mo").is_file()
    assert said() == "停止"  # read from there, and kept while it is the same
    source.write_text(head + 'msgid "Stop."\nmsgstr "已停止。"\n', encoding="utf-8")
    later = time.time() + 60
    os.utime(source, (later, later))
    assert said() == "已停止。"
    source.unlink()  # as in a wheel
    assert said() == "已停止。"


@pytest.mark.parametrize("damage", [b"", b"\xde\x12", b"\xde\x12\x04\x95" + b"\xff" * 24])
def test_a_damaged_catalogue_leaves_english(damage, tmp_path, monkeypatch):
    folder = tmp_path / "zh_CN" / "LC_MESSAGES"
    folder.mkdir(parents=True)
    (folder / "robolink.mo").write_bytes(damage)
    monkeypatch.setattr(languages, "FOLDER", str(tmp_path))
    assert languages.translator("zh") is None
    assert languages.speak("zh") is False


def test_a_language_without_a_catalogue_leaves_english(tmp_path, monkeypatch):
    monkeypatch.setattr(languages, "FOLDER", str(tmp_path))
    assert languages.speak("zh") is False
    assert tr("Connect again.") == "Connect again."
    assert languages.speak("en") is True


# People read local time with its zone; records keep UTC.

RAW = re.compile(
    r"\b(?:when|at|since)=[\w.]*\.(?:begun_at|taken_at|found_at)\b|\{[\w.]*\.begun_at\}"
)
"""A raw recorded label in a sentence."""


@pytest.fixture
def zone(monkeypatch):
    if not hasattr(time, "tzset"):
        pytest.skip("the zone of a process cannot be set here")

    def choose(name):
        monkeypatch.setenv("TZ", name)
        time.tzset()

    yield choose
    monkeypatch.undo()
    time.tzset()


@pytest.mark.parametrize(
    ("name", "shown"),
    [
        ("CET-1", "2026-11-23 14:58 (UTC+1)"),
        ("CST-8", "2026-11-23 21:58 (UTC+8)"),
        ("UTC0", "2026-11-23 13:58 (UTC)"),
        ("<+0530>-5:30", "2026-11-23 19:28 (UTC+5:30)"),
        ("<-0330>3:30", "2026-11-23 10:28 (UTC-3:30)"),
        ("<+14>-14", "2026-11-24 03:58 (UTC+14)"),
    ],
)
def test_a_label_is_shown_as_the_clock_on_the_wall_shows_it(zone, name, shown):
    zone(name)
    assert local_label("2026-11-23T13:58:04+00:00") == shown
    assert local_label("2026-11-23T13:58:04.120Z") == shown


@pytest.mark.parametrize("label", ["", "yesterday", "2026-11-23T13:58:04", "0001-01-01T00:00Z"])
def test_what_is_no_time_is_shown_as_it_is(zone, label):
    zone("EST5")
    assert local_label(label) == label


def test_no_sentence_shows_a_recorded_label_as_it_is():
    assert RAW.search('tr("since {when}", when=marker.begun_at)')
    for folder in ("robolink", "cli"):
        for path in (ROOT / folder).rglob("*.py"):
            assert not RAW.search(path.read_text(encoding="utf-8")), path
