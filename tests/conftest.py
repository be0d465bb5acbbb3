"""Fixtures and hooks that all tests share."""

import gc
import os
import signal
import sys
from contextlib import suppress
from typing import Any

import pytest

from tests import _warm_process
from tests._canary import Watch, install
from tests._documents import DOCUMENTS
from tests._processes import pytest_addoption, pytest_runtestloop  # noqa: F401 - hooks

# Imported modules and collected tests are not garbage: collection is off until the tests begin.
gc.disable()

# Must be set before numpy is imported: threads for six-row matrices cost more than they save, and
# more so with every core.
for _library in ("OPENBLAS", "OMP", "MKL"):
    os.environ.setdefault(f"{_library}_NUM_THREADS", "1")


# Tests write to memory where there is room: a new journal with one entry takes 1.8 ms of CPU there
# and 4.7 ms on a disk. A journal outlives a killed process there too.
if sys.platform == "linux":
    with suppress(AttributeError, OSError):  # no statvfs if POSIX is blocked
        _memory = os.statvfs("/dev/shm")
        if os.access("/dev/shm", os.W_OK) and _memory.f_bavail * _memory.f_frsize > 4 << 30:
            os.environ.setdefault("PYTEST_DEBUG_TEMPROOT", "/dev/shm")


collect_ignore = ["integrator"]
"""A separate project, which ``tests/packaging/test_wheel.py`` runs against the wheel."""

CANARIES = Watch()
"""The passwords of the running test, and everything that it made robolink print or log."""

PATH: list[str] = []
"""What ``sys.path`` was before the first test."""

# Tests compare English sentences, whatever language the desktop is set to.
for _name in ("LC_ALL", "LC_MESSAGES", "LANG"):
    if os.environ.get(_name):
        os.environ[_name] = "C.UTF-8"
os.environ.pop("LANGUAGE", None)


def pytest_configure(config):
    """Leave Hypothesis out of a pytest run inside a test: not needed there, and it costs time.

    The workers of xdist do not count as inside a test: the process that starts them passes nothing
    on.
    """
    starts_workers = bool(getattr(config.option, "numprocesses", 0)) and not hasattr(
        config, "workerinput"
    )
    if not starts_workers:
        added = os.environ.get("PYTEST_ADDOPTS", "")
        os.environ["PYTEST_ADDOPTS"] = f"{added} -p no:hypothesispytest"


def pytest_sessionstart():
    """Prepare what every test of this process needs."""
    # The tester's own passwords stay private; and searching again for a missing package takes a
    # tenth of a short command's time.
    sys.modules["keyring"] = None  # type: ignore[assignment]
    hear_signals()
    install(CANARIES)
    DOCUMENTS.install()
    _warm_process.install()


def pytest_sessionfinish():
    """End the process that this one started for its tests."""
    _warm_process.end()


def hear_signals():
    """Restore signals that a shell (background jobs) or ``nohup`` has set to be ignored.

    Started programs would inherit the ignored signals. A signal with a handler has its default
    again in a started program; so this process survives a closed window, as ``nohup`` intends, and
    a command under test does not.
    """
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    hang_up = getattr(signal, "SIGHUP", None)  # Windows has none
    if hang_up is not None and signal.getsignal(hang_up) is signal.SIG_IGN:
        signal.signal(hang_up, _outlived)


def _outlived(_number, _frame):
    """Do nothing."""


@pytest.fixture
def signals_of_a_terminal(monkeypatch):
    """Give Ctrl-C, SIGTERM and a closed window their usual effect in this process.

    A session that an earlier test left open gets no signals and does not prevent the handlers from
    being restored.
    """
    from robolink import interrupts

    monkeypatch.setattr(interrupts, "_handler", interrupts._Handler())
    usual: dict[int, Any] = {
        signal.SIGINT: signal.default_int_handler,
        signal.SIGTERM: signal.SIG_DFL,
    }
    if hasattr(signal, "SIGHUP"):
        usual[signal.SIGHUP] = signal.SIG_DFL
    before = {number: signal.signal(number, handler) for number, handler in usual.items()}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.fixture(scope="session")
def server():
    """The one PostgreSQL server of a process that runs tests."""
    from tests.contract.journal._postgresql import is_installed, served

    if not is_installed():
        pytest.skip("PostgreSQL is not installed here: initdb and postgres are missing")
    with served() as server:
        yield server


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup():
    """Forget everything recorded before this test.

    This is a hook because a fixture for every test would cost ten times as much.
    """
    CANARIES.begin()
    DOCUMENTS.begin()


def _leave_the_path_as_it_was():
    """Take from ``sys.path`` what a test added.

    A command adds its folder when it loads somebody's module. Left there, it would keep later
    commands from being forked (``tests/_warm_process.py``): a new Python, given this path, would
    look for modules elsewhere than the forked one.
    """
    if sys.path != PATH:
        sys.path[:] = PATH


@pytest.hookimpl(wrapper=True, trylast=True)
def pytest_runtest_teardown(item):
    """Close the test's journals, and check its output for passwords and its documents for faults.

    Thousands of journals left open would be too many. Unread output is read before its capture
    ends.
    """
    given = getattr(item, "funcargs", {})
    captured = given.get("capsys")
    if captured is not None and CANARIES.passwords:
        captured.readouterr()
    try:
        answer = yield
    finally:
        _leave_the_path_as_it_was()
        if "robolink.journal" in sys.modules:
            from robolink.journal import close_files

            close_files()
    _no_password_shows(given)
    _documents_fit_their_schemas()
    return answer


def _no_password_shows(given):
    """Fail a test whose password appears in a file, an output or a log."""
    if not CANARIES.passwords:
        return
    folders = {given[name] for name in ("tmp_path", "robolink_state") if name in given}
    if leaks := CANARIES.leaks(*folders):
        pytest.fail("a password shows: " + ", ".join(leaks), pytrace=False)


def _documents_fit_their_schemas():
    """Fail a test in which a command printed a document that breaks docs/documents.schema.json."""
    if DOCUMENTS.wrong:
        pytest.fail("\n".join(DOCUMENTS.wrong[:9]), pytrace=False)


def pytest_itemcollected(item):
    """Allow soak tests 15 minutes unless they set another limit."""
    if item.get_closest_marker("soak") and not item.get_closest_marker("timeout"):
        item.add_marker(pytest.mark.timeout(900))


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config, items):
    """Leave out the soak tests, and constants of the sources, unless they are asked for."""
    # Tests are selected by name, so a name must not contain a memory address.
    if changing := [item.nodeid for item in items if " at 0x" in item.nodeid]:
        raise pytest.UsageError(f"give this test ids that are alike in each run: {changing[0]}")
    for item in items:
        # The process that prints the table of faults sees reports but no items.
        rows = {row for mark in item.iter_markers("fault") for row in mark.args}
        item.user_properties += [("fault", row) for row in sorted(rows)]
    if "soak" in config.option.markexpr:
        return
    draw_no_constants_of_the_sources()
    know_what_can_be_encoded()
    left_out = [item for item in items if item.get_closest_marker("soak")]
    if left_out:
        config.hook.pytest_deselected(items=left_out)
        items[:] = [item for item in items if not item.get_closest_marker("soak")]


def draw_no_constants_of_the_sources():
    """Let Hypothesis draw the constants that it knows, and none of the sources.

    It would parse every module for them, which takes 3.5 s of CPU in a fresh clone, and compare
    thousands with each strategy. It reads them in ``make soak``.
    """
    providers: Any = sys.modules.get("hypothesis.internal.conjecture.providers")
    if hasattr(providers, "_get_local_constants"):
        providers._get_local_constants = lambda: providers._local_constants


def know_what_can_be_encoded():
    """Tell Hypothesis which characters UTF-8 has: all but surrogates, and each comes back.

    It would encode and decode all 1,114,112 for its texts, a second of CPU in a fresh clone.
    """
    charmap: Any = sys.modules.get("hypothesis.internal.charmap")
    look: Any = getattr(charmap, "intervals_from_codec", None)
    if "tuple" not in str(getattr(look, "__annotations__", {}).get("return")):
        return  # older ones return the first set alone
    intervals = charmap.IntervalSet
    of_utf_8 = intervals(((0, 0xD7FF), (0xE000, sys.maxunicode))), intervals(())
    charmap.intervals_from_codec = lambda codec: of_utf_8 if codec == "utf-8" else look(codec)


def pytest_collection_finish():
    """Keep thousands of collected tests out of garbage collection, and collect less often."""
    PATH[:] = sys.path
    gc.collect()
    gc.freeze()
    gc.enable()
    # A test creates and drops many objects, few of them in reference cycles.
    gc.set_threshold(10_000, 10, 10)
