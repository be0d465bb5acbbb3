"""Which language a name means, where sentences come from, and what a record keeps of them."""

import os
import pickle
import time
from pathlib import Path

import pytest
from robolink_cli.console.language import _of_user, chosen_language

from robolink import messages
from robolink.controllers import advise_emergency_stop
from robolink.errors import ConnectError
from robolink.journal.store.chain import canonical, storable
from robolink.journal.store.failures import damaged_error, journal_error
from robolink.locale import languages
from robolink.messages import joined, plain, spoken, tr
from robolink.pose_tables.values import OpenQuestion, unclear


@pytest.fixture
def marked():
    messages.install(lambda sentence: f"<{sentence}>")
    yield
    messages.install(None)


@pytest.mark.parametrize(
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
    (tmp_path / "robolink.toml").write_text("language = ]")  # said by whoever needs the file
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


@pytest.mark.parametrize(
    "joins",
    [
        lambda: advise_emergency_stop(ConnectError("No answer.", remedy=tr("Check it."))),
        lambda: journal_error(PermissionError("it is read-only"), "a", tr("Nothing was sent.")),
        lambda: damaged_error("a page is bent", "a", tr("Nothing was sent.")),
        lambda: unclear(Path("a"), [OpenQuestion("deg", "turn", tr("Which?"))] * 2),
    ],
)
def test_a_remedy_of_several_sentences_is_kept_in_english_and_has_no_blank_in_chinese(joins):
    messages.install(lambda sentence: f"\u79fb{'{elsewhere}' * ('{e' in sentence)}\u3002")
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
