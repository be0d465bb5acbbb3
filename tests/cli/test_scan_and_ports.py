"""scan and ports: what can be reached from this computer."""

import json
import socket
import time
from types import SimpleNamespace

import pytest
from robolink_cli import main
from robolink_cli.commands.computer import scanning
from robolink_cli.commands.computer.scanning import AddressProbe, State, parse_range

from robolink.errors import ConfigError


@pytest.mark.parametrize(
    ("text", "first", "last", "count"),
    [
        ("192.0.2.7", "192.0.2.7", "192.0.2.7", 1),
        ("192.0.2.1-20", "192.0.2.1", "192.0.2.20", 20),
        ("192.0.2.250-192.0.3.4", "192.0.2.250", "192.0.3.4", 11),
        ("192.0.2.0/28", "192.0.2.0", "192.0.2.15", 16),
        ("192.0.2.9/24", "192.0.2.0", "192.0.2.255", 256),
    ],
)
def test_a_range_is_one_address_two_ends_or_a_network(text, first, last, count):
    addresses = parse_range(text)
    assert (addresses[0], addresses[-1], len(addresses)) == (first, last, count)


@pytest.mark.parametrize(
    "text", ["", "localhost", "192.0.2", "192.0.2.1-300", "192.0.2.1-", "a/24", "::1", "1.2.3.4/99"]
)
def test_what_is_no_range_is_refused_with_an_example(text):
    with pytest.raises(ConfigError, match="no range of addresses") as caught:
        parse_range(text)
    assert "192.168.0.1-20" in caught.value.remedy


@pytest.mark.parametrize(
    ("text", "count"),
    [("192.0.2.0/23", 512), ("192.0.2.0-192.0.3.0", 257), ("192.0.2.9-3", 0), ("0.0.0.0/0", 2**32)],
)
def test_more_than_256_addresses_are_refused_before_any_is_tried(capsys, text, count):
    begun = time.monotonic()
    assert main.run(["scan", text]) == 2
    shown = capsys.readouterr().err
    assert f"stands for {count} addresses" in shown
    assert "1 to 256" in shown
    assert time.monotonic() - begun < 5


@pytest.fixture
def listener():
    with socket.create_server(("127.0.0.1", 0)) as server:
        yield server


def test_an_open_port_is_found_among_closed_ones_and_nothing_is_sent(listener, capsys):
    port = listener.getsockname()[1]
    assert main.run(["scan", "127.0.0.1-3", "--port", str(port), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["urls"] == [f"epson+tcp://127.0.0.1:{port}"]
    assert [(p["address"], p["state"]) for p in document["probes"]] == [
        ("127.0.0.1", "open"),
        ("127.0.0.2", "refused"),
        ("127.0.0.3", "refused"),
    ]
    connection, _ = listener.accept()
    with connection:
        connection.settimeout(5)
        assert connection.recv(100) == b""


def test_a_person_sees_a_url_and_a_count(listener, capsys):
    port = listener.getsockname()[1]
    assert main.run(["scan", "127.0.0.1-2", "--port", str(port)]) == 0
    shown = capsys.readouterr().out
    assert shown.startswith(f"epson+tcp://127.0.0.1:{port}\nport {port}: 1 of 2 addresses")
    assert "no proof of a controller" in shown


def test_nobody_there_is_said_and_is_no_error(listener, capsys):
    port = listener.getsockname()[1]
    listener.close()
    assert main.run(["scan", "127.0.0.1", "--port", str(port)]) == 0
    assert "0 of 1 addresses accepted a connection, 1 refused" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("failure", "state"),
    [
        (TimeoutError(), State.SILENT),
        (ConnectionRefusedError(), State.REFUSED),
        (OSError(113, "No route to host"), State.UNREACHABLE),
    ],
)
def test_each_way_of_not_answering_has_its_name(monkeypatch, failure, state):
    def fail(address, timeout):
        assert (address, timeout) == (("192.0.2.1", 5000), 0.3)
        raise failure

    monkeypatch.setattr(socket, "create_connection", fail)
    (probe,) = scanning.probe_all(["192.0.2.1"], 5000, 0.3)
    assert (probe.address, probe.state) == ("192.0.2.1", state)


def test_256_addresses_are_tried_a_few_at_a_time_and_told_in_order(monkeypatch):
    running = []
    most = []

    def probe(address, _port, _timeout_s):
        running.append(address)
        most.append(len(running))
        time.sleep(0.001)
        running.remove(address)
        return AddressProbe(address, State.SILENT, 0.0)

    monkeypatch.setattr(scanning, "_probe", probe)
    wanted = parse_range("192.0.2.0/24")
    assert [p.address for p in scanning.probe_all(wanted, 5000, 0.3)] == wanted
    assert 1 < max(most) <= 32


class Port(SimpleNamespace):
    def __lt__(self, other):
        return self.device < other.device


@pytest.fixture
def plugged_in(monkeypatch):
    def plug(*ports):
        monkeypatch.setattr("serial.tools.list_ports.comports", lambda: list(ports))

    return plug


def test_no_serial_port_is_said(plugged_in, capsys):
    plugged_in()
    assert main.run(["ports"]) == 0
    assert capsys.readouterr().out == "No serial port was found.\n"
    assert main.run(["ports", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"schema": "robolink/ports/1", "ports": []}


def test_serial_ports_are_listed_by_name_and_whether_they_may_be_used(plugged_in, capsys, tmp_path):
    usable = tmp_path / "ttyUSB0"
    usable.touch()
    plugged_in(
        Port(device=str(tmp_path / "ttyUSB1"), description="adapter", hwid="USB VID:PID=0403:6001"),
        Port(device=str(usable), description="n/a", hwid="n/a"),
    )
    assert main.run(["ports", "--json"]) == 0
    first, second = json.loads(capsys.readouterr().out)["ports"]
    assert first["device"] == str(usable)
    assert (first["usable"], second["usable"]) == (True, False)
    assert (first["description"], second["description"]) == ("", "adapter")
    assert main.run(["ports"]) == 0
    assert capsys.readouterr().out == (
        f"{usable}\n{tmp_path}/ttyUSB1  adapter  USB VID:PID=0403:6001\n"
        "    you may not use it; 'robolink doctor' says what to do\n"
    )
