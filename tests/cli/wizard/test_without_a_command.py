"""Whoever types no command, or a command and no cell, is led on; and reads whole words."""

import re
import tomllib

import pytest
from robolink_cli.console.tables import columns, within
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.streams.epson import serve_tcp

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
        while "There is no recipe here yet" not in hand.text and hand.read(0.2):
            pass
        rows = [row.rstrip() for row in hand.text.split("\n") if row.strip()]
        assert "> gantry-touch-probe" in rows, "the recipes that come along are offered"
        hand.press(["0"])
        assert hand.end() == 9
        assert "You left without choosing.\n  Nothing was sent." in re.sub(" +\n", "\n", hand.text)
        assert [path.name for path in tmp_path.glob("*.toml")] == ["robolink.toml"]
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


TWO_TOUCHES = """
schema = "robolink/recipe/1"
name = "needle"
basis = "absolute"
z = "kept"
[source]
kind = "two-pose"
[station]
id = "PIN-07"
[[tools]]
number = 1
[[prompts]]
at = "before_measure"
text = "Id of the new needle?"
answer = "nozzle"
"""


@pytest.mark.soak
def test_the_id_is_asked_before_anything_moves_and_the_row_says_that_it_is_simulated(tmp_path):
    simulator, recipe = EpsonSimulator(seed=7), tmp_path / "needle.toml"
    recipe.write_text(TWO_TOUCHES)
    with serve_tcp(simulator) as host:
        hand = ScreenHand(["-c", host.url, "change", str(recipe)], simulator)
        try:
            hand.see("Id of the new needle")
            assert hand.screen.display[0].endswith("SIMULATED"), hand.text
            hand.rest(0.4)
            hand.press([*"N-0418", "\r"])
            hand.see(r"Start moving \(2 open\)")
            assert simulator.machine.arm.moves_started == 0
            hand.rest(0.4)
            hand.press(["0"])
            assert hand.end() == 9
        finally:
            hand.close()


@pytest.mark.soak
@pytest.mark.timeout(240)
def test_after_a_tool_the_next_one_begins_with_the_choice_and_nothing_moves_before_its_list(
    tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    simulator, recipe = EpsonSimulator(seed=7), tmp_path / "needle.toml"
    recipe.write_text(TWO_TOUCHES)
    with serve_tcp(simulator, clock=ScaledClock(10.0)) as host:
        words = ["-c", host.url, "change", str(recipe), "--nozzle", "N-0417"]
        hand = ScreenHand(words, simulator)
        try:
            hand.start()
            for touch in ("Touch 1 of 2", "Touch 2 of 2"):
                hand.see(touch)
                hand.touch()
            hand.see("exactly as long")
            hand.rest(0.4)
            hand.press(["2", "5"])
            hand.write_and_prove()
            hand.see(r"\[\+\] Next tool")
            moved = simulator.machine.arm.moves_started
            hand.rest(0.4)
            hand.press(["\r", "3", "+"])
            hand.see(r"Which job\?")
            hand.rest(0.4)
            hand.press(["5"])
            # Its needle is another one: it is asked for, and the list is gone through again.
            hand.see("Id of the new needle")
            hand.rest(0.4)
            hand.press([*"N-0418", "\r"])
            hand.see(r"Start moving \(2 open\)")
            assert simulator.machine.arm.moves_started == moved
            hand.rest(0.4)
            hand.press(["0"])
            assert hand.end() == 9
            assert "Tool 1 is measured, written and tested." in hand.text + hand.raw.decode()
        finally:
            hand.close()


@pytest.mark.parametrize("tools", [1, 2])
def test_each_id_is_asked_once_and_not_again_at_its_moment(tools):
    from robolink.recipe import Answers
    from robolink.recipe._recipe import Recipe

    more = "".join(f"[[tools]]\nnumber = {number}\n" for number in range(2, tools + 1))
    prompts = [("before_measure", "nozzle", "N?"), ("start", "lot", "L?"), ("start", "yes", "Y?")]
    text = TWO_TOUCHES[: TWO_TOUCHES.index("[[prompts]]")] + more
    for at, answer, question in prompts:
        text += f'[[prompts]]\nat = "{at}"\ntext = "{question}"\nanswer = "{answer}"\n'
    recipe = Recipe.model_validate(tomllib.loads(text))
    wanted = list(Answers().ids_wanted(recipe))
    assert [(prompt.text, tool) for _, prompt, tool in wanted] == [
        *[("N?", tool) for tool in range(1, tools + 1)],
        ("L?", None),
    ]
    early = {(number, tool): "x" for number, _, tool in wanted}
    assert list(Answers(early=early).ids_wanted(recipe)) == []
    assert len(list(Answers(nozzle="N").ids_wanted(recipe))) == 1
