"""A chosen part of the suite without the features that Windows lacks, and the suite of Windows."""

import ast
import os
import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

from tests.windows._windows_python import ROOT, TAKEN_ALONG

# A chosen part of the suite in a Python without the features that Windows lacks.
# Source: docs/reference/rules.md 10. Optional features that the library, the simulators and the
# command line use are removed before any of their modules is imported: modules cannot be imported,
# names are gone. pyserial chooses its own half by the operating system, so ``ports`` and ``doctor``
# cannot be run this way.

PROGRAM = '''
import os, select, signal, socket, sys

MODULES = {"fcntl", "termios", "tty", "pty", "pwd", "grp", "resource", "syslog"}
NAMES = {
    socket: ("TCP_USER_TIMEOUT", "TCP_KEEPIDLE", "TCP_KEEPINTVL", "TCP_KEEPCNT", "MSG_DONTWAIT",
             "MSG_NOSIGNAL", "SO_REUSEPORT"),
    select: ("poll", "epoll"),
    os: ("O_DIRECTORY", "openpty", "fork", "fchmod"),
    signal: ("SIGALRM", "setitimer", "SIGHUP", "pthread_sigmask"),
}


class Absent:
    """Finds nothing where a module of POSIX would be."""

    def find_spec(self, name, path=None, target=None):
        if name in MODULES:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)


for name in MODULES:
    sys.modules.pop(name, None)
sys.meta_path.insert(0, Absent())
for module, names in NAMES.items():
    for name in names:
        if hasattr(module, name):
            delattr(module, name)
'''

CHOSEN = (
    "tests/unit/test_interrupts.py",
    "tests/unit/test_transport_tcp_failures.py",
    "tests/unit/test_transport_trace.py",
    "tests/unit/test_config_files.py",
    "tests/contract/test_transport_contract.py",
    "tests/contract/test_epson_login.py",
    "tests/contract/test_epson_tools.py",
    "tests/cli/test_cli_errors.py",
    "tests/cli/test_cli_frame.py",
    "tests/cli/test_cli_output.py",
    "tests/cli/test_cli_password.py",
    "tests/cli/test_config_cells.py",
)

LEFT_OUT = (
    # It removes names itself.
    "tests/unit/test_transport_tcp_failures.py::"
    "test_a_link_works_where_the_platform_lacks_something",
    # The programs that they start have all of POSIX.
    "tests/cli/test_cli_frame.py::test_looking_at_the_commands_loads_none_of_the_heavy_packages",
    "tests/cli/test_cli_output.py::test_no_console_makes_a_sentence_fail",
    "tests/cli/test_cli_output.py::test_a_reader_that_leaves_early_causes_no_noise",
)


AFTERWARDS = """
import pytest
print("tests:", int(pytest.main(sys.argv[1:])))

import robolink.controllers, robolink_simulators.hosting.streams.epson
from robolink_cli.main import run
assert not hasattr(select, "poll") and not hasattr(socket, "MSG_DONTWAIT")
try:
    import termios
except ModuleNotFoundError as error:
    print("lacking:", error)

print("the demonstration")
print("demonstration:", run(["demo", "--speed", "20"]))
"""


@pytest.fixture(scope="module")
def said():
    """What one such Python says of the tests, of what it lacks, and in the demonstration."""
    chosen = (
        *("-q", "-p", "no:cacheprovider", "-p", "no:xdist", "-p", "no:hypothesispytest"),
        "--timeout-method=thread",
        *(f"--deselect={test}" for test in LEFT_OUT),
        *CHOSEN,
    )
    return subprocess.run(
        [sys.executable, "-c", PROGRAM + AFTERWARDS, *chosen],
        cwd=ROOT,
        env={
            **{name: value for name, value in os.environ.items() if not name.startswith("PYTEST_")},
            "PYTHONPATH": os.pathsep.join(path for path in sys.path if path),
            "PYTHONIOENCODING": "ascii",
        },
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=110,
        check=False,
    ).stdout


@pytest.mark.slow
@pytest.mark.timeout(120)
def test_transport_safety_record_driver_and_command_line_work_without_posix(said):
    assert "\ntests: 0\n" in said, said[-5000:]
    (passed,) = re.findall(r"(\d+) passed", said)
    assert int(passed) > 200


def test_the_platform_really_lacks_them(said):
    assert "\nlacking: No module named 'termios'\n" in said, said[-5000:]


def test_the_demonstration_runs_without_posix_and_without_any_but_ascii_characters(said):
    _, _, demonstration = said.partition("\nthe demonstration\n")
    assert demonstration.endswith("\ndemonstration: 0\n"), said[-5000:]
    assert "Turn test passed" in demonstration
    assert demonstration.isascii()


# The tests that run under Windows' Python have the files that every test reads.


def of_tests(module):
    """Yield the test modules that a module imports, and those that these import."""
    tree = ast.parse(Path(module.__file__).read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        name = node.module if isinstance(node, ast.ImportFrom) else None
        if name and name.startswith("tests."):
            found = import_module(name)
            yield found
            yield from of_tests(found)


def test_what_the_tests_read_while_they_are_collected_is_taken_along():
    conftest = import_module("tests.conftest")
    read = {
        value.relative_to(ROOT).as_posix()
        for module in (conftest, *of_tests(conftest))
        for value in vars(module).values()
        if isinstance(value, Path) and value.is_file() and ROOT / "tests" not in value.parents
    }
    assert "docs/documents.schema.json" in read
    assert read <= set(TAKEN_ALONG)
