"""recipe list: what each recipe is for, in the language of the person, no word cut."""

import json

from robolink_cli import main
from robolink_cli.commands.shipped.recipe import PURPOSES, first_comment, models

from tests.contract._terminal import Terminal


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
