"""The tests' own machinery: processes and signals, the search for passwords, injected defects."""

import logging
import os
import signal
import sqlite3
import subprocess
import sys
from pathlib import Path
from textwrap import dedent

import pytest
from hypothesis.internal.conjecture import providers

from robolink.errors import ConfigError, RemoteProtocolError
from robolink.model import Secret
from tests import _warm_process
from tests._rows import each_row
from tests.conftest import CANARIES, PATH, hear_signals, pytest_runtest_teardown
from tests.mutants.changes import Kind, mutants_of
from tests.mutants.places import drawn

# A table of rows in one test.


def test_every_row_that_fails_is_told_and_fails_the_test():
    seen = []

    @each_row(("number", "wanted"), [(1, 1), (2, 3), (4, 4), (0, 5)])
    def check(number, wanted, limit):
        seen.append(number)
        assert limit / number > 0
        assert number == wanted

    with pytest.raises(pytest.fail.Exception) as caught:
        check(limit=9)
    assert seen == [1, 2, 4, 0]
    told = str(caught.value)
    assert told.startswith("2 of 4 rows:")
    assert "number=2, wanted=3" in told
    assert "AssertionError: assert 2 == 3" in told
    assert "number=0, wanted=5" in told
    assert "ZeroDivisionError" in told


def test_a_row_with_marks_or_a_table_without_rows_checks_nothing_in_silence():
    with pytest.raises(AssertionError, match="a test of its own"):
        each_row("number", [pytest.param(1, marks=pytest.mark.soak)])
    with pytest.raises(AssertionError, match="without rows"):
        each_row("number", [])(lambda number: None)()


# A run of the tests: started programs get signals, and processes share the run.

HEARD = (signal.SIGINT, signal.SIGHUP)


def ignored_by_what_is_started():
    """The signals that a program started by this process ignores."""
    told = subprocess.run(["cat", "/proc/self/status"], capture_output=True, text=True, check=True)
    (line,) = (line for line in told.stdout.splitlines() if line.startswith("SigIgn:"))
    mask = int(line.split()[1], 16)
    return [number for number in HEARD if mask >> (number - 1) & 1]


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_what_is_started_hears_signals_that_this_process_was_started_without():
    before = {number: signal.signal(number, signal.SIG_IGN) for number in HEARD}
    try:
        assert ignored_by_what_is_started() == list(HEARD)
        hear_signals()
        assert ignored_by_what_is_started() == []
        signal.raise_signal(signal.SIGHUP)  # the run itself goes on
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_a_command_that_is_started_is_a_child_of_this_process_with_all_imported(tmp_path):
    command = [sys.executable, "-m", "robolink_cli"]
    with subprocess.Popen(
        [*command, "sim", "epson", "--tcp", "127.0.0.1:0", "--json"],
        stdout=subprocess.PIPE,
        cwd=tmp_path,
        start_new_session=True,
    ) as started:
        assert started.stdout is not None
        assert b"epson+tcp" in started.stdout.readline()
        process = Path(f"/proc/{started.pid}")
        assert b"tests._warm_process" in (process / "cmdline").read_bytes()
        assert f"\nPPid:\t{os.getpid()}\n" in (process / "status").read_text()
        assert (process / "cwd").readlink() == tmp_path
        assert os.getsid(started.pid) == started.pid
        started.terminate()
    assert started.returncode == 0
    refused = subprocess.run([*command, "no-such-word"], capture_output=True, check=False)
    assert refused.returncode == 2
    assert b"no-such-word" in refused.stderr
    told = subprocess.run(
        [*command, "expert", "docs", "--help"],
        env=os.environ | {"COLUMNS": "50"},
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    assert max(map(len, told.splitlines())) <= 50


LOADED_BY_MOST = (
    "robolink.controllers.epson.controller",
    "robolink.journal.store.store",
    "platformdirs",
    "rich.table",
    "uvicorn.protocols.http.auto",
)


@pytest.mark.skipif(sys.platform != "linux", reason="forked only there")
def test_what_most_commands_load_late_is_loaded_in_a_command_that_is_started():
    text = "import sys; print(*(name for name in sys.argv[1:] if name not in sys.modules))"
    command = [sys.executable, "-m", "tests._program", text, *LOADED_BY_MOST]
    assert subprocess.run(command, capture_output=True, check=True).stdout == b"\n"


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_a_folder_that_a_command_added_keeps_no_later_one_from_being_forked(tmp_path, request):
    def forked():
        paths = os.pathsep.join(path for path in sys.path if path)
        return _warm_process._warm({**os.environ, "PYTHONPATH": paths}) is not None

    assert forked()
    sys.path.append(str(tmp_path))
    assert not forked()
    ending = pytest_runtest_teardown(request.node)
    next(ending)
    with pytest.raises(StopIteration):
        next(ending)
    assert forked()
    assert sys.path == PATH


SHARED = {
    "test_a.py": "def test_well(tmp_path): pass\ndef test_wrong(): assert not 1",
    "test_b.py": "import os\ndef test_ends_its_process(): os._exit(0)",
}


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
@pytest.mark.soak
@pytest.mark.parametrize(
    ("asked", "code", "told"),
    [
        (["test_a.py"], 1, "1 failed, 1 passed"),
        (["-x", "test_a.py"], 1, "stopping after 1 failures"),
        (["test_a.py", "test_b.py"], 2, "ended in the middle"),
    ],
)
def test_processes_that_share_the_tests_tell_how_each_ended(tmp_path, asked, code, told):
    for name, text in SHARED.items():
        (tmp_path / name).write_text(text)
    command = [sys.executable, "-m", "pytest", "-p", "tests._processes", "--processes", "2"]
    done = subprocess.run(
        [*command, "-p", "no:cacheprovider", *asked],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, told in done.stdout) == (code, True), done.stdout


def test_only_soak_draws_the_constants_of_the_sources(pytestconfig):
    if not hasattr(providers, "_get_local_constants"):
        pytest.skip("this Hypothesis looks for no constants in the sources")
    found = providers._get_local_constants().set_for_type("string")
    assert bool(found) is ("soak" in pytestconfig.option.markexpr)


# The search for passwords finds one wherever it is.

CANARY = "canary-5af1"


@pytest.fixture
def leaks(tmp_path, capsys):
    """Look for the canary, then forget it, so that the test itself does not fail for it."""

    def found():
        capsys.readouterr()
        places = CANARIES.leaks(tmp_path)
        CANARIES.begin()
        for file in tmp_path.iterdir():
            file.unlink()
        return places

    Secret(CANARY)
    return found


def test_a_password_that_is_kept_to_oneself_is_not_found(leaks, tmp_path):
    (tmp_path / "journal").write_text("Secret('***')")
    (tmp_path / "password").write_text(f"{CANARY}\n")  # where a person put it
    sys.stdout.write(f"{Secret(CANARY)} {Secret(CANARY)!r}")
    logging.getLogger("robolink").warning("%s", Secret(CANARY))
    assert leaks() == []


def test_it_is_found_in_a_file_of_any_kind(leaks, tmp_path):
    database = tmp_path / "journal.sqlite3"
    with sqlite3.connect(database) as journal:
        journal.execute("create table entry (details text)")
        journal.execute("insert into entry values (?)", (f'{{"request": "$Login,{CANARY}"}}',))
    journal.close()
    (tmp_path / "trace").write_text(f"sent $Login,{CANARY}\n")
    assert sorted(leaks()) == [str(database), str(tmp_path / "trace")]


@pytest.mark.parametrize("stream", ["stdout", "stderr"])
def test_it_is_found_in_what_is_printed(leaks, stream):
    getattr(sys, stream).write(f"logging in with {CANARY}")
    assert leaks() == ["shown"]


def test_it_is_found_in_what_another_process_prints(leaks):
    subprocess.run([sys.executable, "-c", f"print({CANARY!r})"], capture_output=True, check=True)
    assert leaks() == ["shown by another process"]


def test_it_is_found_in_what_is_logged(leaks):
    logging.getLogger("pymodbus").warning("sent %s", CANARY)
    assert leaks() == ["logged by pymodbus"]


def test_it_is_found_in_an_error_that_nobody_sees(leaks):
    ConfigError("wrong", remedy=f"use {CANARY}")
    RemoteProtocolError("wrong", raw=f"$Login,{CANARY}".encode())
    RemoteProtocolError(f"no answer to $Login,{CANARY}")
    assert leaks() == ["ConfigError", "RemoteProtocolError", "RemoteProtocolError"]


# The small defects that ``python -m tests.mutants`` puts into a module, and those it leaves out.


def changes(text, kind):
    """Return the changes of one kind in a module with the given lines."""
    found = mutants_of("module.py", dedent(text).encode())
    return [one.change for one in found if one.kind is kind]


@each_row(
    ("kind", "body", "expected"),
    [
        (Kind.COMPARISON, "return a < b <= c", ["a < b => a <= b", "b <= c => b < c"]),
        (Kind.COMPARISON, "return a is not b", ["a is not b => a is b"]),
        (Kind.COMPARISON, "return a not in b", ["a not in b => a in b"]),
        (Kind.CONSTANT, "return 2", ["2 => 3"]),
        (Kind.CONSTANT, "return True", ["True => False"]),
        (Kind.CONSTANT, "return 0.5", ["0.5 => 0.75"]),
        (Kind.ORDER, "return a - b", ["a - b => (b) - (a)"]),
        (Kind.ORDER, "g(a.x_mm, b.y_mm)", ["a.x_mm, b.y_mm => b.y_mm, a.x_mm"]),
        (Kind.ORDER, "mark(); send()", ["mark(); send() => send(); mark()"]),
        (Kind.ORDER, "b = g(a); h(b)", []),
        (Kind.NEGATION, "return 1 if a else 2", ["a => (not (a))"]),
        (Kind.NEGATION, "return not a", ["not a => (a)"]),
        (Kind.NEGATION, "return a and b", ["a and b => a or b"]),
        (Kind.NEGATION, "return 1 if a == b else 2", []),
        (Kind.CALL, "g(a)", ["g(a) => pass"]),
        (Kind.CALL, "return abs(a)", ["abs(a) => (a)"]),
        (Kind.CALL, "\n    with lock: return a", ["with lock => if True"]),
    ],
)
def test_a_line_is_changed_as_a_tired_person_would(kind, body, expected):
    assert changes(f"def f(a, b, c): {body}", kind) == expected


@each_row(
    "text",
    [
        '"""What it is."""',
        "def f(): return tr('Press {count} keys.', 'a')",
        "x: Annotated[int, Ge(0)]",
        "@dataclass(frozen=True)\nclass A: pass",
        "def __repr__(self): return g(1 < 2)",
        "if TYPE_CHECKING: g(1)",
        "__all__ = [1]",
    ],
)
def test_what_says_nothing_to_a_machine_is_left_out(text):
    assert mutants_of("module.py", text.encode()) == []


def test_a_mutant_is_the_module_with_one_change():
    source = "def f(a):\n    # ä\n    return 'ö', a < 1, a < 1\n".encode()
    first, second = [one for one in mutants_of("module.py", source) if one.kind is Kind.COMPARISON]
    assert first.applied(source) == source.replace(b"a < 1, a", b"a <= 1, a")
    assert second.applied(source) == source.replace(b"a < 1\n", b"a <= 1\n")
    assert (first.line, first.where, second.name) == (3, "f", "module.py f: a < 1 => a <= 1 #2")


def test_a_draw_is_a_sample_that_a_line_elsewhere_does_not_change(tmp_path):
    package = tmp_path / "robolink"
    package.mkdir()
    (package / "a.py").write_text("".join(f"def f{n}(a): return a < {n}\n" for n in range(40)))
    before = [one.name for one in drawn(tmp_path, seed=1, count=20)]
    (package / "b.py").write_text("def g(a): return a\n")
    assert [one.name for one in drawn(tmp_path, seed=1, count=20)] == before
    assert [one.name for one in drawn(tmp_path, seed=1, count=10)] == before[:10]
    assert [one.name for one in drawn(tmp_path, seed=2, count=20)] != before
