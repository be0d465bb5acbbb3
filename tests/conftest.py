"""What all tests have in common."""

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

# Nothing of what is imported and collected is garbage: a search for it begins with the tests.
gc.disable()

# Before anything imports numpy: threads for matrices of six rows cost far more than they bring,
# the more so the more cores a machine has.
for _library in ("OPENBLAS", "OMP", "MKL"):
    os.environ.setdefault(f"{_library}_NUM_THREADS", "1")


# What tests write stands in memory where there is room: a new journal with one entry takes 1.8 ms
# of CPU there, 4.7 ms on a disk; and that it outlives a killed process shows there too.
if sys.platform == "linux":
    with suppress(AttributeError, OSError):  # no statvfs where POSIX is taken away
        _memory = os.statvfs("/dev/shm")
        if os.access("/dev/shm", os.W_OK) and _memory.f_bavail * _memory.f_frsize > 4 << 30:
            os.environ.setdefault("PYTEST_DEBUG_TEMPROOT", "/dev/shm")


collect_ignore = ["integrator"]
"""A project of its own, which ``tests/packaging/test_wheel.py`` runs against the wheel."""

CANARIES = Watch()
"""Every password of the test that runs, and what it made robolink say."""

# Sentences are compared in English, in whatever language the tester's desktop is.
for _name in ("LC_ALL", "LC_MESSAGES", "LANG"):
    if os.environ.get(_name):
        os.environ[_name] = "C.UTF-8"
os.environ.pop("LANGUAGE", None)


def pytest_configure(config):
    """Start a pytest inside of a test without Hypothesis: no use for it, and it takes longer.

    The workers of xdist are not inside of a test: what starts them passes nothing on.
    """
    starts_workers = bool(getattr(config.option, "numprocesses", 0)) and not hasattr(
        config, "workerinput"
    )
    if not starts_workers:
        added = os.environ.get("PYTEST_ADDOPTS", "")
        os.environ["PYTEST_ADDOPTS"] = f"{added} -p no:hypothesispytest"


def pytest_sessionstart():
    """Prepare what every test of this process needs."""
    # The tester's own passwords are nobody's business; and looking anew for a package that is not
    # there is a tenth of a short command's time.
    sys.modules["keyring"] = None  # type: ignore[assignment]
    hear_signals()
    install(CANARIES)
    DOCUMENTS.install()
    _warm_process.install()


def pytest_sessionfinish():
    """End what this process started for its tests."""
    _warm_process.end()


def hear_signals():
    """Undo what a shell does to jobs in the background, and ``nohup`` to all: signals ignored.

    Whatever the tests start would inherit that. A signal that has a handler is the usual one again
    in a program that is started; so this process outlives a closed window, as ``nohup`` wants it,
    and a command under test does not.
    """
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    hang_up = getattr(signal, "SIGHUP", None)  # Windows has none
    if hang_up is not None and signal.getsignal(hang_up) is signal.SIG_IGN:
        signal.signal(hang_up, _outlived)


def _outlived(_number, _frame):
    """Go on."""


@pytest.fixture
def signals_of_a_terminal(monkeypatch):
    """Ctrl-C, a termination and a closed window do in this process what they usually do.

    A session that an earlier test left open is not heard, and keeps nothing from being given back.
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


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup():
    """Forget what was said and printed before this test.

    What is done for each test is a hook: a fixture for it would cost ten times as much.
    """
    CANARIES.begin()
    DOCUMENTS.begin()


@pytest.hookimpl(wrapper=True, trylast=True)
def pytest_runtest_teardown(item):
    """Close the journal of each test, and look at what it said.

    Thousands of open files would be too many. What a test left unread is heard before its capture
    ends.
    """
    given = getattr(item, "funcargs", {})
    captured = given.get("capsys")
    if captured is not None and CANARIES.passwords:
        captured.readouterr()
    try:
        answer = yield
    finally:
        if "robolink.journal" in sys.modules:
            from robolink.journal import close_files

            close_files()
    _no_password_shows(given)
    _documents_fit_their_schemas()
    return answer


def _no_password_shows(given):
    """Fail a test whose password stands in anything that was written, said or logged."""
    if not CANARIES.passwords:
        return
    folders = {given[name] for name in ("tmp_path", "robolink_state") if name in given}
    if leaks := CANARIES.leaks(*folders):
        pytest.fail("a password shows: " + ", ".join(leaks), pytrace=False)


def _documents_fit_their_schemas():
    """Fail a test in which a command printed a document that docs/documents.schema.json denies."""
    if DOCUMENTS.wrong:
        pytest.fail("\n".join(DOCUMENTS.wrong[:9]), pytrace=False)


def pytest_itemcollected(item):
    """Give what is there for its length 15 minutes, where it asks for no other limit."""
    if item.get_closest_marker("soak") and not item.get_closest_marker("timeout"):
        item.add_marker(pytest.mark.timeout(900))


def pytest_collection_modifyitems(config, items):
    """Leave out what ``make soak`` is for, unless the command line speaks of it."""
    # A test is asked for by its name, so a name may hold no address in memory.
    if changing := [item.nodeid for item in items if " at 0x" in item.nodeid]:
        raise pytest.UsageError(f"give this test ids that are alike in each run: {changing[0]}")
    for item in items:
        # The process that prints the table of faults sees reports, not items.
        rows = {row for mark in item.iter_markers("fault") for row in mark.args}
        item.user_properties += [("fault", row) for row in sorted(rows)]
    if "soak" in config.option.markexpr:
        return
    left_out = [item for item in items if item.get_closest_marker("soak")]
    if left_out:
        config.hook.pytest_deselected(items=left_out)
        items[:] = [item for item in items if not item.get_closest_marker("soak")]


def pytest_collection_finish():
    """Leave thousands of collected tests out of each later search for garbage; it is rarer, too."""
    gc.collect()
    gc.freeze()
    gc.enable()
    # And search less often: a test makes and drops much, and little of it is garbage in circles.
    gc.set_threshold(10_000, 10, 10)
