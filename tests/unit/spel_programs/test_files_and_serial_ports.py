"""Input and output of programs: files, serial lines, the operator's window."""

import os
import tty
from contextlib import contextmanager

import pytest
from robolink_simulators.epson.spel.file_commands import read_points
from robolink_simulators.epson.spel.file_folder import FileFolder

# Files of a program, in a folder that it cannot leave (docs/reference/spel.md 18).


@pytest.fixture
def folder(tmp_path):
    made = tmp_path / "files"
    made.mkdir()
    (tmp_path / "secret.txt").write_text("not yours\n")
    return made


@pytest.fixture
def run(cell, folder):
    """Returns the output of a main with a String a$ and an Integer n; its files are in a folder."""

    def ran(*lines, **options):
        text = ["Function main", "String a$", "Integer n", "Byte z(3)", *lines, "Fend"]
        made = cell("\n".join(text), **options)
        made.runner.session.files.root = folder
        shown = made.run()
        if made.runner.failure is not None:
            return made.runner.failure.number
        return shown

    return ran


def test_what_is_written_is_read_line_by_line(run, folder):
    shown = run(
        'WOpen "log.txt" As #30; Print #30, "one", 2; Print #30, "a,", 3; Close #30',
        'AOpen "log.txt" As #31; Write #31, "last"; Close #31',
        'ROpen "log.txt" As #FreeFile; Print Lof(30), Eof(30)',
        "Line Input #30, a$; Print a$; Input #30, a$, n; Print a$, n",
        "Read #30, a$, 3; Print a$, Eof(30); Read #30, a$, 9; Print a$, Eof(30)",
        "Seek #30, 4; Line Input #30, a$; Print a$",
        "Close #30",
    )
    assert shown == ["3 0", "one 2", "a 3", "las 0", "t -1", "2"]
    assert (folder / "c" / "log.txt").read_bytes() == b"one 2\r\na, 3\r\nlast"


def test_bytes_go_to_and_fro_in_a_binary_file_alone(run, folder):
    shown = run(
        'BOpen "b" As #30; z(0) = 1; z(1) = 2; z(2) = 99; WriteBin #30, z(), 3; WriteBin #30, 255',
        "Seek #30, 2; ReadBin #30, n; Print n; ReadBin #30, n; Print n",
    )
    assert shown == ["99", "255"]
    assert (folder / "c" / "b").read_bytes() == b"\x01\x02\x63\xff"
    assert run('UOpen "b" As #30; ReadBin #30, n') == 2449
    assert run('WOpen "b" As #30; WriteBin #30, 1') == 2449


def test_what_is_kept_back_is_written_by_flush(cell, folder):
    made = cell('Function main\nWOpen "x" As #30\nPrint #30, 1\nWait 1\nFlush #30\nWait 1\nFend')
    made.runner.session.files.root = folder
    made.runner.start("main", 0)
    made.simulator.advance(500_000_000)
    assert (folder / "c" / "x").read_bytes() == b""
    made.simulator.advance(1_500_000_000)
    assert (folder / "c" / "x").read_bytes() == b"1\r\n"


def test_folders_and_drives_are_gone_into(run, folder):
    shown = run(
        'MkDir "d"; WOpen "d\\e.txt" As #30; Close #30; Copy "d/e.txt", "f.txt"; Print CurDir$',
        'ChDir "d"; Print CurDir$, FileExists("e.txt"), FileExists("\\f.txt"), FileExists("f.txt")',
        'Rename "e.txt", "g.txt"; Print FileExists("e.txt"), FileExists("C:\\d\\g.txt")',
        'Del "g.txt"; ChDir ".."; RmDir "d"; Print FolderExists("d")',
        'ChDrive "E"; Print CurDrive$, FileExists("f.txt"), FileExists("c:/f.txt")',
    )
    assert shown == ["C:\\", "C:\\d -1 -1 0", "0 -1", "0", "E 0 -1"]
    assert sorted(p.name for p in (folder / "c").iterdir()) == ["f.txt"]


@pytest.mark.parametrize(
    "name", ["..\\secret.txt", "d\\..\\..\\secret.txt", "C:\\..\\secret.txt", "/../../secret.txt"]
)
def test_no_name_leads_out_of_the_folder(run, folder, name):
    for statement in (
        f'ROpen "{name}" As #30',
        f'WOpen "{name}" As #30',
        f'Del "{name}"',
        f'Copy "{name}", "mine"',
        f'ImportPoints "{name}", "p.pts"',
        f'Print FileExists("{name}")',
    ):
        assert run(statement) == 7203
    assert (folder.parent / "secret.txt").read_text() == "not yours\n"


def test_no_link_leads_out_of_the_folder(run, folder):
    (folder / "c").mkdir()
    (folder / "c" / "link").symlink_to(folder.parent)
    assert run('ROpen "link\\secret.txt" As #30') == 7203
    assert run('ChDir "link"') == 7203
    (folder / "d").symlink_to(folder.parent, target_is_directory=True)
    assert run('ROpen "d:\\secret.txt" As #30') == 7203
    assert run('WOpen "d:\\new.txt" As #30') == 7203
    assert not (folder.parent / "new.txt").exists()


@pytest.mark.parametrize(
    ("line", "number"),
    [
        ('WOpen "a" As #30; WOpen "b" As #30', 2440),
        ('ROpen "none" As #30', 2441),
        ("Print #30, 1", 2442),
        ("Close #30", 2442),
        ('WOpen "a" As #29', 4002),
        ('WOpen "a" As #30; Seek #30, -1', 2445),
        ('WOpen "a" As #30; Line Input #30, a$', 2447),
        ('WOpen "a" As #30; Close #30; ROpen "a" As #30; Print #30, 1', 2448),
        ('WOpen "a" As #30; Close #30; ROpen "a" As #30; Line Input #30, a$', 2452),
        ('WOpen "a*" As #30', 2450),
        ('ChDrive "12"', 2455),
        ('ChDir "none"', 2456),
        ('Del "none"', 7213),
        ('Copy "none", "a"', 7213),
        ('MkDir "a"; MkDir "a"', 7203),
        ('WOpen "a" As #30; Print #30, "x,y"; Close #30; ROpen "a" As #30; Input #30, a$', 2505),
        ('LoadPoints "none.pts"', 7213),
        ('LoadPoints "a b.pts"', 2522),
        ('SavePoints "c:\\a.pts"', 2522),
        ('SavePoints "a234567890123456789012345678901234.pts"', 2520),
        ('ImportPoints "none.pts", "a.pts"', 7213),
        ('WOpen "a" As #30; Print #30, 1; Close #30; ImportPoints "a", "a.pts", 2', 2262),
    ],
)
def test_what_cannot_be_has_its_own_number(run, line, number):
    assert run(line) == number


def test_numbers_of_files_come_to_an_end(run):
    opened = "For n = 30 To 63; WOpen Str$(n) As #n; Next"
    assert run(opened.replace("; ", "\n"), "Print FreeFile") == 2446


def test_a_file_belongs_to_its_task_and_is_closed_with_it(cell, folder):
    made = cell(
        "Function main\nXqt 2, writer\nWait 0.1\nOnErr GoTo other\nPrint #30, 2\nother:\n"
        'Print Err\nTaskWait 2\nWOpen "a" As #30\nFend\n'
        'Function writer\nWOpen "a" As #30\nPrint #30, 1\nWait 1\nFend'
    )
    made.runner.session.files.root = folder
    assert made.run() == ["2443"]
    assert made.runner.failure is None


def test_points_come_in_and_go_out_as_files(run, folder, tmp_path):
    shown = run(
        'P1 = XY(1, 2, 3, 4) /L /2; P7 = XY(1.5, 0, 0, 0); PLabel 7, "pin"',
        'SavePoints "mine"; ExportPoints "mine.pts", "out.pts"; ClearPoints',
        'ImportPoints "out.pts", "back.pts"; Print PDef(1); LoadPoints "back.pts"',
        "Print CX(pin), CY(P1), Hand(P1), PLocal(P1)",
        'ClearPoints; P2 = Here; LoadPoints "back", Merge; Print PDef(1), PDef(2)',
        'LoadPoints "back"; Print PDef(1), PDef(2)',
    )
    assert shown == ["0", "1.5 2 2 2", "-1 -1", "-1 0"]
    points, labels = read_points(folder / "c" / "out.pts")
    assert sorted(points) == [1, 7]
    assert labels == {"pin": 7}


def test_a_folder_of_its_own_is_gone_at_the_end():
    files = FileFolder()
    root = files.root
    (root / "kept").write_text("x")
    del files
    assert not root.exists()


# SetCom, OpenCom, ChkCom: a program uses a serial line assigned to it.


@contextmanager
def line():
    """A pseudo terminal: its far end, and the name of its near end."""
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


# Input from the window: a person answers, or a script did before (docs/reference/spel.md 17).

ASKING = "\n".join(
    [
        "Function main",
        "Real a, b",
        "String s$",
        "Input a",
        "Input b, s$",
        "Print a, b, s$",
        "Line Input s$",
        'Print #21, s$, "!"',
        "Fend",
    ]
)


def test_lines_are_taken_in_their_order_and_asked_for_with_a_mark(cell):
    made = cell(ASKING)
    made.runner.channels.window.type("25.1x", "-10000, text", "A, B, C")
    assert made.run() == ["??25.1 -10000text", "?A, B, C!"]


def test_a_task_waits_until_somebody_types_and_others_go_on(cell):
    made = cell(ASKING + "\nFunction main1\nXqt main\nWait 30\nPrint Tmr(0) > 29\nFend")
    made.runner.start("main1", 0)
    made.simulator.advance(40_000_000_000)
    assert "".join(made.runner.console) == "?-1\r\n"
    assert len(made.runner.tasks) == 1
    made.runner.channels.window.type("1", "2 b", "c")
    made.simulator.advance(41_000_000_000)
    assert not made.runner.tasks
    assert "".join(made.runner.console).endswith("c!\r\n")


def test_wrong_numbers_of_data_and_silence_are_one_error(cell):
    made = cell(ASKING)
    made.runner.channels.window.type("1", "2")
    made.run()
    assert made.runner.failure.number == 2505
    made = cell(ASKING)
    made.runner.channels.window.ask = lambda: None
    made.run()
    assert made.runner.failure.number == 2505


def test_a_blank_separates_variables_and_belongs_to_the_last_text(cell):
    asking = "Function main\nString s$, t$\nInteger n\nInput s$\nInput n, t$\nPrint s$, n, t$\nFend"
    made = cell(asking)
    made.runner.channels.window.type("reach 100 450 600", "7 two words")
    assert made.run() == ["??reach 100 450 600 7two words"]
    made = cell(asking, input_blank="everywhere")
    made.runner.channels.window.type("reach 100 450 600")
    made.run()
    assert made.runner.failure.number == 2505
