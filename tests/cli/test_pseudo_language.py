"""The main commands in a language that marks every sentence: unmarked text is untranslated.

Each sentence is put between 【 and 】 and is two fifths longer, so a literal outside the catalogue
shows, and so does text that the journal keeps.
"""

import io
import json
import re
import sys

import click
import pytest
from robolink_cli import main
from robolink_cli.console import language
from robolink_cli.console.tables import columns
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.in_process.epson import register, unregister
from robolink_simulators.hosting.streams.epson import serve_tcp

MARKS = "\u3010\u3011"

# Names, numbers, units and signs; the parts of a click metavar or a choice.
NOT_SENTENCES = re.compile(r"[A-Za-z]+(?:[,:;]? [a-z]+){2,}")


def pseudo(sentence):
    body = sentence.lstrip()
    if not body:
        return sentence
    indent = sentence[: len(sentence) - len(body)]
    return f"{indent}{MARKS[0]}{body}{' ~' * (len(body) // 5)}{MARKS[1]}"


@pytest.fixture
def marked(monkeypatch, tmp_path):
    monkeypatch.setattr(language, "translator", lambda name: pseudo)
    monkeypatch.setenv("ROBOLINK_LANG", "zh")
    monkeypatch.chdir(tmp_path)
    simulator = EpsonSimulator(seed=3)
    register("pseudo", simulator)
    yield simulator
    unregister("pseudo")


def unmarked(text):
    """Return runs of three or more words outside the marks; commands do not count."""
    left = re.sub(r"robolink( -*[a-z-]+)*", "", text)
    while (shorter := re.sub(r"\u3010[^\u3010\u3011]*\u3011", " ", left)) != left:
        left = shorter
    return NOT_SENTENCES.findall(left)


URL = "epson+sim://pseudo"

COMMANDS = [
    ["-c", URL, "status"],
    ["-c", URL, "robot", "where"],
    ["-c", URL, "tool", "list"],
    ["-c", URL, "tool", "set", "1", "--x", "0.1", "--yes"],
    ["-c", URL, "tool", "set", "1", "--x", "nonsense"],
    ["-c", URL, "undo", "--yes"],
    ["-c", URL, "robot", "jog", "x+50", "--yes"],
    ["-c", URL, "recover"],
    ["-c", URL, "change", "absent.toml"],
    ["-c", URL, "calibrate", "two-pose", "--tool", "1", "--dry-run"],
    ["-c", URL, "nonsense"],
    ["journal", "list"],
    ["cell", "list"],
    ["cell", "files"],
    ["stop"],
]


@pytest.mark.parametrize("arguments", COMMANDS, ids=lambda words: " ".join(words[:6]))
def test_what_a_command_says_comes_from_the_catalogue(marked, arguments, capfd):
    main.run(arguments)
    said = capfd.readouterr()
    assert re.search("[\u3010\u4e00-\u9fff]", said.out + said.err)  # some come from click
    assert unmarked(said.out + said.err) == []


@pytest.fixture(scope="module", autouse=True)
def other_help_options():
    """A process uses one language, so click caches the option ``--help`` of each command."""
    forget_help_options()
    yield
    forget_help_options()


def forget_help_options(command: click.Command = main.cli):
    command._help_option = None
    if not isinstance(command, click.Group):
        return
    context = click.Context(command)
    for name in (*command.list_commands(context), *getattr(command, "_unlisted", ())):
        child = command.get_command(context, name)
        assert child is not None
        forget_help_options(child)


def test_help_pages_come_from_the_catalogue_and_keep_to_their_width(marked, capfd):
    for words in (["--help"], ["tool", "set", "--help"], ["calibrate", "n-angle", "--help"]):
        assert main.run(words) == 0
        page = capfd.readouterr().out
        assert MARKS[0] in page
        assert unmarked(page) == []
        assert max(columns(line) for line in page.splitlines()) <= 80


def test_journal_and_json_stay_english(marked, capfd, tmp_path):
    with serve_tcp(marked) as host:
        assert main.run(["-c", host.url, "tool", "set", "2", "--x", "0.2", "--yes"]) == 0
        assert main.run(["-c", host.url, "undo", "--yes"]) == 0
    said = capfd.readouterr()
    assert MARKS[0] in said.out + said.err
    assert main.run(["journal", "export", "all.jsonl"]) == 0, capfd.readouterr().err
    assert MARKS[0] not in (tmp_path / "all.jsonl").read_text(encoding="utf-8")
    capfd.readouterr()
    assert main.run(["-c", URL, "robot", "jog", "x+50", "--yes", "--json"]) != 0
    said = capfd.readouterr()
    assert MARKS[0] not in said.out + said.err
    assert json.loads(said.out)["error"]["what"]


def test_every_command_takes_a_language(marked):
    def without(command, context, name):
        names = {option for one in command.params for option in one.opts}
        if isinstance(command, click.Group):
            for child in command.list_commands(context):
                found = command.get_command(context, child)
                assert found is not None
                inner = click.Context(found, parent=context, info_name=child)
                yield from without(found, inner, f"{name} {child}")
        elif "--lang" not in names:
            yield name

    root = click.Context(main.cli, info_name="robolink")
    assert list(without(main.cli, root, "")) == []


@pytest.mark.parametrize(("encoding", "english"), [("ascii", True), ("gbk", False)])
def test_a_window_without_chinese_characters_gets_english_and_one_line_why(
    encoding, english, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    window = io.BytesIO()
    for name in ("stdout", "stderr"):
        stream = io.TextIOWrapper(window, encoding=encoding, write_through=True)
        monkeypatch.setattr(sys, name, stream)
    assert main.run(["--lang", "zh", "cell", "list"]) == 0
    said = window.getvalue().decode(encoding)
    assert ("This window cannot show Chinese" in said) is english
    assert ("There is no cell" in said) is english
