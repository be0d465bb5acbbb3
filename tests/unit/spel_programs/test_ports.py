"""Network statements on real sockets of this machine (docs/reference/spel.md 17)."""

import socket
import threading

import pytest
from robolink_simulators.epson.spel.tasks.runner import run_to_end


def drive(cell, most_s=20.0):
    """Run main with a partner on a socket; return the output."""
    cell.runner.start("main", 0)
    ended = run_to_end(
        cell.runner, cell.simulator.advance, cell.simulator.next_change, most_s=most_s
    )
    assert ended
    return "".join(cell.runner.console).splitlines()


@pytest.fixture
def partner():
    """Makes servers that serve one client each by a function."""
    threads, listeners = [], []

    def serve(talk):
        listener = socket.create_server(("127.0.0.1", 0))
        listener.settimeout(10)

        def work():
            link, _ = listener.accept()
            with link:
                link.settimeout(10)
                talk(link, link.makefile("rb"))

        thread = threading.Thread(target=work)
        thread.start()
        threads.append(thread)
        listeners.append(listener)
        return listener.getsockname()[1]

    yield serve
    for thread in threads:
        thread.join(10)
    for listener in listeners:
        listener.close()


def client(port, *lines):
    """Returns a main that connects first."""
    begin = (
        "Function main",
        f'SetNet #201, "127.0.0.1", {port}, CRLF, NONE, 5',
        "Print ChkNet(201)",
        "OpenNet #201 As Client",
        "WaitNet #201, 5",
        "Print TW, ChkNet(201) >= 0",
    )
    return "\n".join([*begin, *lines, "Fend"])


def test_a_program_asks_and_reads_the_answer(cell, partner):
    """Checks 1, 4, 5, 16 of programs."""
    heard = []

    def talk(link, lines):
        heard.append(lines.readline())
        heard.append(lines.read(4))
        link.sendall(b"7, 8.5 word\r\nthe rest, as it is\r\nXY")

    port = partner(talk)
    made = cell(
        client(
            port,
            "Integer n",
            "Real r",
            "String s$, w$",
            'Print #201, "A", 5, "B"',
            'Write #201, "pi" + CRLF',
            "Input #201, n, r, w$",
            "Print n, r, w$",
            "Line Input #201, s$",
            "Print s$, Lof(201)",
            "Read #201, s$, 2",
            "Print s$",
            "CloseNet #201",
            "Print ChkNet(201)",
        )
    )
    shown = drive(made)
    assert shown == ["-3", "0 -1", "7 8.5word", "the rest, as it is 0", "XY", "-3"]
    assert heard == [b"A 5B\r\n", b"pi\r\n"]


def test_a_controller_is_a_server_too(cell):
    """Bytes both ways, as in programs with Modbus."""
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    made = cell(
        "Function main\nUByte b(3)\nInteger n\nOpenNet #202 As Server\nWaitNet #202\n"
        "ReadBin #202, b(), 3\nn = b(0) + b(1) * 256\nPrint n, b(2)\nb(0) = 255\n"
        "WriteBin #202, b(), 2\nWriteBin #202, b(2), 1\nWait 0.1\nFend\n",
        ports={202: ("127.0.0.1", port)},
    )
    heard = []

    def talk():
        for _ in range(1000):
            try:
                with socket.create_connection(("127.0.0.1", port), 10) as link:
                    link.sendall(bytes([1, 2, 3]))
                    heard.append(link.makefile("rb").read(3))
                    return
            except ConnectionRefusedError:
                continue

    made.runner.start("main", 0)
    made.simulator.advance(10_000_000)
    thread = threading.Thread(target=talk)
    thread.start()
    run_to_end(made.runner, made.simulator.advance, made.simulator.next_change, most_s=20)
    thread.join(10)
    assert made.runner.failure is None
    assert "".join(made.runner.console).splitlines() == ["513 3"]
    assert heard == [bytes([255, 2, 3])]


def test_an_end_that_came_between_two_looks_is_seen_at_the_next(cell):
    """Time passes outside while it stands still for the controller."""
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    made = cell(
        "Function main\nOpenNet #202 As Server\nWaitNet #202\nPrint 1\nFend\n",
        ports={202: ("127.0.0.1", port)},
    )
    made.runner.start("main", 0)
    made.simulator.advance(10_000_000)
    with socket.create_connection(("127.0.0.1", port), 10):
        change = made.simulator.next_change()
        assert change > made.simulator.now_ns
        made.simulator.advance(change)
    assert list(made.runner.console) == ["1\r\n"]


def test_a_link_that_breaks_is_dealt_with_and_opened_again(cell, partner):
    """Check 7 of programs."""

    def hang_up(link, lines):
        lines.readline()

    def answer(link, lines):
        lines.readline()
        link.sendall(b"here\r\n")

    first, second = partner(hang_up), partner(answer)
    made = cell(
        client(
            first,
            "String s$",
            "OnErr GoTo lost",
            "again:",
            'Print #201, "hello"',
            "Line Input #201, s$",
            "Print s$",
            "Exit Function",
            "lost:",
            'Print "lost"',
            "CloseNet #201",
            f'SetNet #201, "localhost", {second}, CRLF, NONE, 5',
            "OpenNet #201 As Client",
            "WaitNet #201",
            "EResume again",
        )
    )
    assert drive(made)[2:] == ["lost", "here"]


def test_waiting_for_nobody_ends_by_tw_and_reading_by_an_error(cell, partner):
    """Check 3 of programs."""
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    made = cell(
        f'Function main\nSetNet #201, "127.0.0.1", {port}, CRLF, NONE, 0.2\n'
        "OpenNet #201 As Client\nWaitNet #201, 0.1\nPrint TW, ChkNet(201)\nFend\n"
    )
    assert drive(made) == ["-1 -1"]
    silence = threading.Event()
    quiet = partner(lambda link, lines: silence.wait(10))
    made = cell(client(quiet, "String s$", "Line Input #201, s$").replace("NONE, 5", "NONE, 0.1"))
    drive(made)
    silence.set()
    assert made.runner.failure.number == 2910


@pytest.mark.parametrize(
    ("lines", "number"),
    [
        (['Print #201, "x"'], 2909),
        (['SetNet #201, "10.1.2.3", 5000, CRLF, NONE, 0', "OpenNet #201 As Client"], 2904),
        (["OpenNet #201 As Client"], 2906),
        (["OpenNet #300 As Client"], 4002),
        (
            [
                'SetNet #201, "127.0.0.1", 9, CRLF, NONE, 0',
                "OpenNet #201 As Client",
                'SetNet #201, "127.0.0.1", 9, CRLF, NONE, 0',
            ],
            2908,
        ),
        (['SetNet #201, "127.0.0.1", 9, CRLF, NONE, 0, UDP'], 2199),
    ],
)
def test_ports_are_refused_by_name(failure, lines, number):
    """Check 6 of programs."""
    assert failure(*lines).number == number


def test_wrong_data_are_an_error(cell, partner):
    """Check 2 of programs: 2505 (p. 432)."""
    port = partner(lambda link, lines: link.sendall(b"1 2 3\r\n"))
    made = cell(client(port, "Integer a, b", "Input #201, a, b"))
    drive(made)
    assert made.runner.failure.number == 2505


def test_a_port_belongs_to_the_task_that_opened_it(cell, partner):
    """Check 4 of programs: -2."""
    port = partner(lambda link, lines: lines.read())
    made = cell(
        client(port, "Xqt other", "Wait 0.05")
        + "\nFunction other\nPrint ChkNet(201), OpenNet(201)\nOnErr GoTo h\nPrint #201, 1\n"
        "h:\nPrint Err\nFend\n"
    )
    assert drive(made)[2:] == ["-2 1", "2912"]
    assert not made.runner.ports.in_use
