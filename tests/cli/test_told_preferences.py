"""Messages about the controller's preferences, and when they are shown."""

import json

import pytest
from robolink_cli import main
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.hosting.in_process.epson import register, unregister


@pytest.fixture
def cell(state_folder, capsys):
    names = []

    def made(**habits):
        simulator = EpsonSimulator(seed=4, options=EpsonOptions(**habits))
        names.append(f"told-{id(simulator):x}")
        register(names[-1], simulator)

        def run(*arguments):
            code = main.run(["-c", simulator.url, *arguments])
            shown = capsys.readouterr()
            return code, shown.out, shown.err

        return simulator, run

    yield made
    for name in names:
        unregister(name)


@pytest.mark.parametrize(
    ("habit", "said"),
    [("dry_run", "DRY RUN is set"), ("virtual_io", "VIRTUAL I/O is set")],
)
def test_status_says_that_the_cell_is_not_real(cell, habit, said):
    _, run = cell(**{habit: True})
    assert said in run("status")[1]
    assert json.loads(run("status", "--json")[1])["preferences"][habit] is True


def test_older_firmware_is_not_mentioned(cell):
    _, run = cell(extended_queries=False)
    code, out, err = run("status")
    assert code == 0
    assert "outputs" not in out + err
    assert json.loads(run("status", "--json")[1])["preferences"] is None


@pytest.mark.parametrize(
    ("habits", "said"),
    [
        ({}, "SWITCHES THE OUTPUTS OFF"),
        ({"reset_outputs_off": False}, "the outputs stay"),
        ({"extended_queries": False}, ""),
    ],
)
def test_what_a_reset_does_to_the_outputs_is_said_before_it_is_sent(cell, habits, said):
    simulator, run = cell(**habits)
    simulator.machine.outputs.set(3, True)
    simulator.panel.raise_error(4002)
    sent = []
    simulator.on_request = lambda _, text: sent.append(text)
    code, _, err = run("reset", "--yes")
    assert code == 0
    assert said in err
    assert bool(said) is ("outputs" in err.lower())
    assert simulator.machine.outputs.get(3) is ("stay" in said)
    asked = [text for text in sent if text in ("$GetContSettings", "$Reset")]
    assert asked == ["$GetContSettings", "$Reset"]


def test_a_write_beside_a_dry_run_ends_with_5_and_says_what_to_do(cell):
    simulator, run = cell(dry_run=True)
    code, _, err = run("tool", "set", "1", "--x", "12.5")
    assert code == 5
    assert "not really move" in err
    assert simulator.machine.flash_writes == 0
