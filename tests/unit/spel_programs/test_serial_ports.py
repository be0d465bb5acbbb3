"""SetCom, OpenCom, ChkCom: a program talks over a serial line that was named for it."""

import os
import tty
from contextlib import contextmanager

import pytest


@contextmanager
def line():
    """A pseudo terminal: its far end, and the name of its near one."""
    far, near = os.openpty()
    tty.setraw(near)
    os.set_blocking(far, False)
    try:
        yield far, os.ttyname(near)
    finally:
        os.close(far)
        os.close(near)


def started(cell, device, *lines):
    made = cell("\n".join(["Function main", *lines, "Fend"]))
    made.runner.ports.devices[1] = device
    made.runner.start("main", 0)
    return made


def step(made, seconds=0.1):
    made.simulator.advance(made.simulator.now_ns + round(seconds * 1e9))


def printed(made):
    assert made.runner.failure is None, made.runner.failure
    return "".join(made.runner.console).splitlines()


def test_a_program_asks_over_a_line_and_reads_the_answer(cell):
    """P. 719: end of line and time-out are those of SetCom."""
    with line() as (far, device):
        made = started(
            cell,
            device,
            "String a$",
            "Integer n",
            "Print ChkCom(1)",
            "SetCom #1, 38400, 8, 1, N, CR, NONE, NONE, 5",
            "OpenCom #1",
            "Print ChkCom(1), OpenCom(1)",
            'Print #1, "MS,", 7',
            "Line Input #1, a$",
            "Print a$",
            "Input #1, a$, n",
            "Print a$, n",
            'Write #1, "end"',
            "Read #1, a$, 3",
            "Print a$",
            "CloseCom #1",
            "Print ChkCom(1)",
        )
        step(made)
        assert os.read(far, 100) == b"MS, 7\r"
        os.write(far, b"first\rsecond 12\rraw")
        step(made, 0.5)
        assert os.read(far, 100) == b"end"
    assert printed(made) == ["-3", "0 1", "first", "second 12", "raw", "-3"]


def test_silence_is_an_error_after_the_time_that_was_set(cell):
    with line() as (_, device):
        made = started(
            cell,
            device,
            "String a$",
            "SetCom #1, 9600, 7, 2, E, LF, NONE, NONE, 2",
            "OpenCom #1",
            "Line Input #1, a$",
        )
        step(made, 3)
    numbers = made.simulator.options.numbers
    assert made.runner.failure.number == numbers.port_timed_out
    assert made.runner.failure.line == 5


def test_a_line_that_is_gone_is_an_error_that_onerr_takes(cell):
    far, near = os.openpty()
    tty.setraw(near)
    try:
        made = started(
            cell,
            os.ttyname(near),
            "String a$",
            "OnErr GoTo gone",
            "OpenCom #1",
            "Line Input #1, a$",
            "gone:",
            "Print Err",
        )
        step(made)
        os.close(far)
        step(made)
    finally:
        os.close(near)
    assert printed(made) == [str(made.simulator.options.numbers.port_broken)]


@pytest.mark.parametrize(
    ("lines", "reason"),
    [
        (("OpenCom #2",), "port_unset"),
        (("OpenCom #1", "OpenCom #1"), "port_open_already"),
        (("OpenCom #5",), "value_out_of_range"),
        (("SetCom #1, 9600, 6",), "value_out_of_range"),
        (("SetCom #1, 230400",), "value_out_of_range"),
        (("SetCom #1, 9600, 8, 1, N, CR, RTS",), "not_simulated"),
        (('Print #1, "x"',), "port_not_open"),
    ],
)
def test_what_no_line_can_do_is_refused_by_name(cell, lines, reason):
    with line() as (_, device):
        made = started(cell, device, *lines)
        step(made)
    assert made.runner.failure.number == getattr(made.simulator.options.numbers, reason)


def test_a_line_that_is_not_there_is_an_error_of_the_program(cell):
    made = started(cell, "/dev/ttyS77x", "OpenCom #1")
    step(made)
    assert made.runner.failure.number == made.simulator.options.numbers.port_in_use


def test_a_port_belongs_to_one_program_and_is_given_back_at_its_end(cell):
    with line() as (_, device):
        for _ in range(2):
            made = started(cell, device, "OpenCom #1", "Print OpenCom(1)")
            step(made)
            assert printed(made) == ["1"]
