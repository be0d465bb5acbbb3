"""``sim softmotion --opcua`` and ``sim plc --opcua``, and the same in a file of cells."""

import sys
from contextlib import ExitStack

import pytest
from robolink_cli import main
from robolink_cli.commands.simulate.cells_file import read_cells
from robolink_cli.commands.simulate.sim import sim
from robolink_simulators.hosting import fieldbus
from robolink_simulators.hosting.fieldbus.opcua import serve_opcua
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator
from robolink_simulators.testkit.operator import written_map, written_symbol_map

import robolink
from robolink.controllers import SoftMotionController
from robolink.errors import ConfigError
from tests.contract._opcua_peer import OpcuaPeer

DEVICE = "Simulated SoftMotion PLC"
HEAD = 'schema = "robolink/sim-cells/1"\n'
PASSWORD = "correct-horse-battery"


def connected(url):
    return robolink.connect(url, kind=SoftMotionController)


@pytest.fixture
def served(tmp_path):
    """Serve the only cell of a file until the end of the test, and return it with its document."""
    with ExitStack() as stack:

        def serve(table):
            path = tmp_path / "cells.toml"
            path.write_text(f"{HEAD}[cells.a]\n{table}", encoding="utf-8")
            (cell,) = read_cells(path, sim.commands)
            simulator = cell.kind.make(**cell.given)
            one = cell.kind.serve(stack, simulator, cell.given, person=False)
            return simulator, one.document("http://127.0.0.1/")

        yield serve


def test_a_mailbox_is_served_beside_other_buses_and_the_urls_say_how(served):
    table = 'kind = "softmotion"\ntcp = "127.0.0.1:0"\nopcua = "0"\n'
    simulator, document = served(table)
    urls = document["urls"]
    assert list(urls) == ["modbus-tcp", "opcua", "opcua-unsecured"]
    assert "server_certificate=" in urls["opcua"]
    assert urls["opcua-unsecured"].endswith("?security=none&write_unsecured=yes")
    plain, other = urls["opcua-unsecured"], document["url"]
    with connected(plain) as one, connected(other) as two:
        assert one.tools.read(1) == two.tools.read(1)
        assert one.device_id == two.device_id  # one PLC, whatever the link
    assert simulator.exchanges


def test_a_map_of_symbols_is_served_over_opc_ua_and_a_map_of_registers_is_not(served, tmp_path):
    path = written_symbol_map(tmp_path)
    _, document = served(f'kind = "plc"\nmap = "{path}"\nopcua = "127.0.0.1:0"\n')
    assert list(document["urls"]) == ["opcua", "opcua-unsecured"]
    with robolink.connect(document["urls"]["opcua-unsecured"]) as controller:
        assert controller.tools.read(2)
    with pytest.raises(ConfigError, match="names registers"):
        served(f'kind = "plc"\nmap = "{written_map(tmp_path)}"\nopcua = "127.0.0.1:0"\n')
    with pytest.raises(ConfigError, match="names symbols"):
        served(f'kind = "plc"\nmap = "{path}"\ntcp = "127.0.0.1:0"\n')


def test_a_user_comes_in_with_the_password_of_the_environment(served, monkeypatch, capsys):
    monkeypatch.setenv("PLC_PASSWORD", PASSWORD)
    table = 'kind = "softmotion"\nopcua = "127.0.0.1:0"\nopcua_user = "ada"\n'
    _, document = served(f'{table}opcua_password_env = "PLC_PASSWORD"\n')
    url = document["urls"]["opcua"]
    assert "user=ada" in url
    assert "write_unsecured" not in url
    assert PASSWORD not in str(document)
    with OpcuaPeer(url, DEVICE, user=("ada", PASSWORD)) as peer:
        assert peer.read("RL_Symbols.response")
    with pytest.raises(ConfigError, match="a name and a password"):
        served(table)
    monkeypatch.delenv("PLC_PASSWORD")
    with pytest.raises(ConfigError, match="PLC_PASSWORD holds no password"):
        served(f'{table}opcua_password_env = "PLC_PASSWORD"\n')
    assert PASSWORD not in "".join(capsys.readouterr())


@pytest.mark.parametrize("place", ["127.0.0.1:4840", "4840"])
def test_each_cell_of_a_file_gets_a_port_of_its_own(tmp_path, place):
    path = tmp_path / "cells.toml"
    cells = f'[cells.a]\nkind = "softmotion"\ncount = 2\nopcua = "{place}"\n'
    path.write_text(HEAD + cells, encoding="utf-8")
    places = [cell.given["opcua"] for cell in read_cells(path, sim.commands)]
    assert places == ["127.0.0.1:4840", "127.0.0.1:4841"]
    path.write_text(
        f'{HEAD}{cells}[cells.b]\nkind = "softmotion"\nopcua = "127.0.0.1:4841"\n', encoding="utf-8"
    )
    with pytest.raises(ConfigError, match="uses it already"):
        read_cells(path, sim.commands)


def test_a_plan_is_refused_before_anything_is_served_if_the_link_cannot_have_it(tmp_path, capsys):
    plan = tmp_path / "plan.toml"
    text = 'schema = "robolink/faults/1"\nlink = "softmotion+opcua"\n[[fault]]\naction = "{}"\n'
    plan.write_text(text.format("shift_map"), encoding="utf-8")
    line = ["sim", "softmotion", "--opcua", "127.0.0.1:0", "--faults", str(plan)]
    assert main.run(line) == 2
    assert "shift_map cannot happen on softmotion+opcua" in capsys.readouterr().err
    plan.write_text(text.format("tear_array"), encoding="utf-8")
    assert main.run(["sim", "softmotion", "--tcp", "127.0.0.1:0", "--faults", str(plan)]) == 2
    assert "tear_array cannot happen on softmotion+modbus-tcp" in capsys.readouterr().err


@pytest.mark.parametrize("place", ["0.0.0.0:0", "nowhere", ":0", "-1", "65536"])
def test_an_address_that_is_none_or_that_others_reach_is_refused(place, capsys):
    assert main.run(["sim", "softmotion", "--opcua", place]) == 2
    assert capsys.readouterr().out == ""


def test_without_asyncua_it_says_what_to_install(monkeypatch):
    monkeypatch.delitem(sys.modules, f"{fieldbus.__name__}.opcua_server", raising=False)
    monkeypatch.delattr(fieldbus, "opcua_server", raising=False)
    monkeypatch.setitem(sys.modules, "asyncua", None)
    with pytest.raises(ConfigError) as refused:
        serve_opcua(SoftMotionSimulator())
    assert "pip install 'robolink[opcua]'" in refused.value.remedy
