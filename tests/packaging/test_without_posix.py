"""A chosen part of the suite in a Python that lacks what Windows lacks.

Source: docs/reference/rules.md 10.

What the library, the simulators and the command line use where it exists is taken away before
anything of theirs is imported: modules cannot be imported, names are gone. pyserial chooses
its own half by the operating system, so ``ports`` and ``doctor`` cannot be run this way.
"""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

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
    "tests/unit/test_recipe_files.py",
    "tests/unit/test_interrupts.py",
    "tests/unit/test_transport_registry.py",
    "tests/unit/test_transport_tcp_failures.py",
    "tests/unit/test_transport_trace.py",
    "tests/unit/test_url.py",
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
    # It takes names away itself.
    "tests/unit/test_transport_tcp_failures.py::"
    "test_a_link_works_where_the_platform_lacks_something",
    # Thousands of files that are read alike everywhere.
    "tests/unit/test_recipe_files.py::test_whatever_stands_in_a_place_is_accepted_or_told",
)


def run(program, *arguments, **variables):
    return subprocess.run(
        [sys.executable, "-c", PROGRAM + program, *arguments],
        cwd=ROOT,
        env={
            **{name: value for name, value in os.environ.items() if not name.startswith("PYTEST_")},
            "PYTHONPATH": os.pathsep.join(path for path in sys.path if path),
            **variables,
        },
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=110,
        check=False,
    )


def test_the_platform_really_lacks_them():
    done = run(
        "import select, socket\n"
        "import robolink.controllers, robolink_cli.main\n"
        "import robolink_simulators.hosting.streams.epson\n"
        "assert not hasattr(select, 'poll') and not hasattr(socket, 'MSG_DONTWAIT')\n"
        "import termios\n"
    )
    assert done.stderr.endswith("ModuleNotFoundError: No module named 'termios'\n"), done.stderr


def test_the_demonstration_runs_without_posix_and_without_any_but_ascii_characters():
    done = run(
        "from robolink_cli.main import run\nsys.exit(run(['demo', '--speed', '20']))\n",
        PYTHONIOENCODING="ascii",
    )
    assert done.returncode == 0, done.stderr
    assert "Turn test passed" in done.stdout
    assert (done.stdout + done.stderr).isascii()


@pytest.mark.slow
@pytest.mark.timeout(120)
def test_transport_safety_record_driver_and_command_line_work_without_posix():
    done = run(
        "import pytest\nsys.exit(pytest.main(sys.argv[1:]))\n",
        *("-q", "-p", "no:cacheprovider", "-p", "no:xdist", "-p", "no:hypothesispytest"),
        "--timeout-method=thread",
        *(f"--deselect={test}" for test in LEFT_OUT),
        *CHOSEN,
    )
    assert done.returncode == 0, done.stdout[-5000:] + done.stderr
    (passed,) = re.findall(r"(\d+) passed", done.stdout)
    assert int(passed) > 200
