"""One set of option names for every simulator, grouped on its help page; old names still work."""

import json

import click
import pytest
from robolink_cli import main
from robolink_cli.commands.simulate.sim import sim
from robolink_cli.console.help_pages import SectionedCommand

from tests.cli.test_names_of_before import run_on_terminal

SERVED = ("epson", "softmotion", "plc")
OF_EVERY_COMMAND = {"--json", "--lang"}
COMMON = {
    *("--tcp", "--serial", "--allow-remote", "--seed", "--speed", "--faults"),
    *("--control", "--with-parent", "--idle-exit"),
}


def options(name):
    command = sim.commands[name]
    assert isinstance(command, SectionedCommand)
    return command, {
        one.opts[0]: one
        for one in command.params
        if isinstance(one, click.Option) and not one.hidden
    }


@pytest.mark.parametrize("name", SERVED)
def test_each_simulator_has_the_common_names_and_every_option_a_heading(name):
    command, shown = options(name)
    assert set(shown) >= COMMON
    grouped = frozenset().union(*(names for _, names in command.sections))
    assert set(shown) - grouped == OF_EVERY_COMMAND


def test_an_option_of_one_name_takes_the_same_everywhere():
    kinds: dict[str, set[str]] = {}
    for name in SERVED:
        for option, parameter in options(name)[1].items():
            kinds.setdefault(option, set()).add(parameter.type.name)
    # A project of SPEL+ is files, an exported PLC program a folder.
    assert {one for one, found in kinds.items() if len(found) > 1} == {"--program"}


def test_the_help_page_says_each_option_once_and_no_name_of_before(capsys):
    assert main.run(["sim", "softmotion", "--help"]) == 0
    page = capsys.readouterr().out
    assert "--modbus" not in page
    for option in options("softmotion")[1]:
        assert page.count(f"\n  {option} ") == 1, option
    headings = ["Where it is served:", "What is simulated:", "Options:"]
    assert [page.index(one) for one in headings] == sorted(page.index(one) for one in headings)


@pytest.mark.parametrize("name", ["softmotion", "plc"])
def test_a_name_of_before_says_its_new_one_on_a_terminal_and_does_the_same(name, tmp_path):
    more = ["--map", str(tmp_path / "none.toml")] if name == "plc" else []
    words = ["sim", name, *more, "--modbus-tcp", "nowhere"]
    code, shown = run_on_terminal(*words)
    assert (code, shown[0]) == (2, "--modbus-tcp is now called --tcp.")
    code, shown = run_on_terminal(*words, "--tcp", "127.0.0.1:0")
    assert code == 2
    assert "--modbus-tcp is now called --tcp: give one of them." in " ".join(shown)


@pytest.mark.parametrize("option", ["--modbus-tcp", "--tcp"])
def test_an_address_of_either_name_is_refused_by_todays(option, capsys):
    assert main.run(["--json", "sim", "softmotion", option, "nowhere"]) == 2
    error = json.loads(capsys.readouterr().out)["error"]
    assert "'nowhere' is not an address" in error["what"]
    assert error["remedy"] == "Write for example --tcp 127.0.0.1:5000."
