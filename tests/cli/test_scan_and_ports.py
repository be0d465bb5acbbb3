"""scan and ports: the devices and ports within reach of this computer."""

import json
import os
import select
import socket
import threading
import time
import tty
from types import SimpleNamespace

import pytest
from robolink_cli import main
from robolink_cli.commands.computer import scan
from robolink_cli.commands.computer.scan import AddressProbe, State, parse_range
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.epson import EpsonOptions, EpsonSimulator
from robolink_simulators.hosting.streams.epson import serve_serial
from robolink_simulators.hosting.streams.serial_host import SerialCable

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
    with pytest.raises(ConfigError, match="not a range of addresses") as caught:
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
    assert "need not be a controller" in shown


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
    (probe,) = scan.probe_all(["192.0.2.1"], 5000, 0.3)
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

    monkeypatch.setattr(scan, "_probe", probe)
    wanted = parse_range("192.0.2.0/24")
    assert [p.address for p in scan.probe_all(wanted, 5000, 0.3)] == wanted
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
    assert json.loads(capsys.readouterr().out) == {
        "schema": "robolink/ports/1",
        "ports": [],
        "problems": [],
    }


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
        "    no permission to use it; 'robolink cell doctor' says what to do\n"
    )


SENT = "04 02 53 03 50"


def scanned(capsys, *urls):
    """Scan lines with the shortest time-out; return the findings for each."""
    lines = [word for url in urls for word in ("--line", url)]
    assert main.run(["scan", *lines, "--timeout", "0.05", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert (document["probes"], document["urls"]) == ([], [])
    return document["lines"]


@pytest.mark.parametrize("eot", ["none", "ack"])
def test_a_controller_at_a_serial_line_is_known_by_its_refusal(capsys, eot):
    options = EpsonOptions(rs232_eot_answer=eot)
    simulator = EpsonSimulator(seed=3, options=options)
    with serve_serial(simulator, clock=ScaledClock(40.0)) as host:
        (found,) = scanned(capsys, host.url)
        assert (found["found"], found["sent"]) == ("controller", SENT)
        # NAK, the letter of GetStatus, error 11: nobody is logged in.
        assert found["received"].endswith("15 53 31 31 03 50")
    assert [text for _, way, text in simulator.log if way == ">"] == ["$GetStatus"]


@pytest.fixture
def far_end():
    """A cable, with an answer of its far end to each piece received."""
    cable, over, heard = SerialCable(), threading.Event(), list[bytes]()
    far = os.open(cable.far, os.O_RDWR | os.O_NOCTTY)
    tty.setraw(far)

    def serve(answer, unasked=b""):
        def run():
            while not over.is_set():
                os.write(far, unasked)
                if select.select([far], [], [], 0.05)[0]:
                    heard.append(os.read(far, 256))
                    os.write(far, answer(heard[-1]))

        thread.append(threading.Thread(target=run))
        thread[0].start()
        return f"epson+serial://{cable.near}?baud=9600", heard

    thread = list[threading.Thread]()
    try:
        yield serve
    finally:
        over.set()
        for one in thread:
            one.join()
        os.close(far)
        cable.close()


@pytest.mark.parametrize(
    ("answer", "found"),
    [
        (lambda piece: piece, "other"),
        (lambda piece: b"OK\r\n" if piece[:1] == b"\x02" else b"", "other"),
        (lambda piece: b"\x06" if piece == b"\x04" else b"", "other"),
        (lambda piece: b"", "nobody"),
    ],
    ids=["an echo", "a modem", "an acknowledgement alone", "silence"],
)
def test_what_is_no_controller_gets_five_bytes_and_no_more(capsys, far_end, answer, found):
    url, heard = far_end(answer)
    (line,) = scanned(capsys, url)
    assert line["found"] == found
    # The far end may not have received yet what the near end sent.
    deadline = time.monotonic() + 10
    while len(b"".join(heard)) < len(SENT.split()) and time.monotonic() < deadline:
        time.sleep(0.01)
    assert b"".join(heard).hex(" ") == line["sent"] == SENT


def test_into_a_conversation_of_others_nothing_is_sent(capsys, far_end):
    url, heard = far_end(lambda piece: b"", unasked=b"12.50 g\r\n")
    (line,) = scanned(capsys, url)
    assert (line["found"], line["sent"]) == ("talking", "")
    assert heard == []
    assert main.run(["scan", "--line", url]) == 0
    shown = capsys.readouterr().out
    assert "something sends there unasked; robolink sent nothing" in shown
    assert "sent: nothing; received: 31 32" in shown


def test_a_line_that_cannot_be_opened_is_told_and_the_next_one_asked(capsys, far_end):
    url, _ = far_end(lambda piece: b"")
    missing = "epson+serial:///dev/ttyS77x?baud=9600"
    first, second = scanned(capsys, missing, url)
    assert (first["found"], second["found"]) == ("unusable", "nobody")
    assert "ttyS77x" in first["why"]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((), "range of addresses, or a serial line"),
        (("--line", "epson+tcp://127.0.0.1:1"), "not a serial line of an EPSON controller"),
        (("--line", "epson+serial:///dev/ttyS77x"), "baud"),
        (("--line", "epson+serial:///dev/ttyS77x?baud=9600&numbers=roman"), "numbers"),
    ],
)
def test_a_line_that_makes_no_sense_is_refused(capsys, arguments, said):
    assert main.run(["scan", *arguments]) == 2
    assert said in capsys.readouterr().err


def test_ports_and_doctor_know_the_cells_on_a_line(
    plugged_in, capsys, tmp_path, monkeypatch, robolink_state
):
    del robolink_state
    monkeypatch.chdir(tmp_path)
    there = tmp_path / "ttyUSB0"
    there.touch()
    (tmp_path / "robolink.toml").write_text(
        f'[cells.here]\nurl = "epson+serial://{there}?baud=9600"\n'
        '[cells.gone]\nurl = "epson+serial:///dev/ttyUSB77?baud=9600"\n'
    )
    plugged_in(Port(device=str(there), description="n/a", hwid="n/a"))
    assert main.run(["ports"]) == 0
    assert f"{there}\n    cells: here\n" in capsys.readouterr().out
    main.run(["doctor"])
    shown = capsys.readouterr()
    assert "/dev/ttyUSB77 of gone was not found." in shown.out + shown.err


@pytest.mark.parametrize(
    ("command", "code"), [(["ports"], 1), (["scan", "127.0.0.1", "--port", "1"], 0)]
)
def test_a_system_that_does_not_list_its_ports_is_one_line(capsys, monkeypatch, command, code):
    def fails():
        raise OSError(13, "Permission denied")

    monkeypatch.setattr("serial.tools.list_ports.comports", fails)
    sentence = "The serial ports of this computer could not be listed (PermissionError: "
    assert main.run(command) == code
    assert sentence in capsys.readouterr().out
    assert main.run([*command, "--json"]) == code
    (problem,) = json.loads(capsys.readouterr().out)["problems"]
    assert problem.startswith(sentence)
