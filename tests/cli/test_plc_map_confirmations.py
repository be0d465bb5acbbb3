"""That a person confirmed a map holds for one PLC, however it is named, and for no other one."""

import pytest
from robolink_cli import main
from robolink_simulators.plc import PlcSimulator, serve_plc

from robolink.register_maps import RegisterTable, load_map
from tests.cli.test_plc_map_commands import MAPS
from tests.faults._second_address import SecondAddress

NUMBER_AT = 60
NUMBER = f"""
[device_id]
table = "holding"
address = {NUMBER_AT}
"""


@pytest.fixture
def shown(state_folder, capsys):
    """Run a command line; return the exit code and what was shown to a person."""

    def ran(*arguments):
        code = main.run(arguments)
        return code, capsys.readouterr().err

    return ran


@pytest.fixture
def machine(state_folder, tmp_path):
    """A map without a probe that knows where the PLC's own number stands, and such a PLC."""
    path = tmp_path / "machine.toml"
    text = (MAPS / "no-handshake.toml").read_text(encoding="utf-8")
    path.write_text(text + NUMBER, encoding="utf-8")
    return path, PlcSimulator(load_map(path), seed=1)


def number(plc, value):
    plc.program.memory.write(RegisterTable.HOLDING, NUMBER_AT, [value, 0])


def compare(url):
    return ["-c", url, "plc", "check-map", "--shows", "1.x=-5.44", "--operator", "Kim"]


def write(url):
    return ["-c", url, "tool", "set", "1", "--x", "2.5", "--dry-run"]


def test_another_spelling_of_the_host_keeps_the_confirmation(shown, state_folder):
    path = MAPS / "no-handshake.toml"
    host = serve_plc(PlcSimulator(load_map(path), seed=1), path)
    with host, SecondAddress(host.url) as second:
        assert shown(*compare(host.url))[0] == 0
        assert shown(*write(host.url.replace("127.0.0.1", "localhost")))[0] == 0
        # Without a number of its own it might be another one.
        code, err = shown(*write(second.url))
        assert (code, "Nobody has compared" in err) == (2, True)


def test_a_plc_with_a_number_keeps_it_at_each_of_its_addresses(shown, machine):
    path, plc = machine
    number(plc, 4711)
    with serve_plc(plc, path) as host, SecondAddress(host.url) as second:
        assert shown(*write(second.url))[0] == 2
        assert shown(*compare(host.url))[0] == 0
        assert shown(*write(second.url))[0] == 0
        code, err = shown("-c", second.url, "plc", "check-map", "--shows", "1.x=9.99")
        assert (code, "The confirmation by Kim" in err, "taken back" in err) == (2, True, True)
        assert shown(*write(host.url))[0] == 2


def test_another_plc_at_the_same_address_does_not_inherit_it(shown, machine):
    path, plc = machine
    number(plc, 4711)
    with serve_plc(plc, path) as host:
        assert shown(*compare(host.url))[0] == 0
        number(plc, 4712)
        code, err = shown(*write(host.url))
        assert (code, "Nobody has compared" in err) == (2, True)
        number(plc, 0)  # a program that has not started yet
        code, err = shown(*write(host.url))
        assert (code, "reads zero" in err) == (5, True)
        number(plc, 4711)
        assert shown(*write(host.url))[0] == 0
    assert plc.writes == []
