"""Whoever types no command, or a command and no cell, is led on; and reads whole words."""

import re

import pytest
from robolink_cli.console.columns import columns, within

from tests.cli.wizard._screen import ScreenHand


def test_a_sentence_on_a_terminal_is_broken_at_blanks_and_keeps_its_edge():
    text = "robolink: short\n  Give -c CELL, or for example -c epson+tcp://192.168.0.1:5000."
    assert within(text, 40).split("\n") == [
        "robolink: short",
        "  Give -c CELL, or for example -c",
        "  epson+tcp://192.168.0.1:5000.",
    ]
    assert all(
        columns(row) <= 20 for row in within("  没有移动。允许范围以开始时机器人", 20).split("\n")
    )


@pytest.mark.parametrize(
    "words",
    [["-c", "epson+tcp://127.0.0.1:1"], pytest.param([], marks=pytest.mark.soak)],
)
def test_a_cell_without_a_command_is_asked_for_a_job(words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "robolink.toml").write_text('[cells.line3]\nurl = "epson+tcp://127.0.0.1:1"\n')
    hand = ScreenHand(words)
    try:
        assert hand.end() == 2
        assert "No recipe stands beside the cell file" in hand.text
        rows = [row.rstrip() for row in hand.text.split("\n") if row.strip()]
        assert not any(re.search("STOPPED|Missing", row) for row in rows), "nothing was begun"
        assert rows[-1].endswith("calibrate two-pose --tool N")
    finally:
        hand.close()


@pytest.mark.soak
def test_a_recovery_takes_the_only_cell_there_is(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "robolink.toml").write_text('[cells.line3]\nurl = "epson+tcp://127.0.0.1:1"\n')
    monkeypatch.delenv("ROBOLINK_CONTROLLER", raising=False)
    hand = ScreenHand(["recover"])
    try:
        assert hand.end() == 3
        assert "127.0.0.1:1 refuses" in hand.text
    finally:
        hand.close()
