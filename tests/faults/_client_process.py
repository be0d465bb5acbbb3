"""The real command line in a process of its own, to be killed or interrupted.

Each process is forked from a small single-threaded server that has loaded the command line: a new
interpreter for every kill point would cost more than everything else.
"""

import multiprocessing
import os
import signal
import sys
from collections.abc import Mapping, Sequence
from multiprocessing.connection import wait
from pathlib import Path

from tests._patience import PATIENCE_S

_FORKS = multiprocessing.get_context("forkserver")
_FORKS.set_forkserver_preload(
    [
        "tests.faults._loaded_first",
        # Other processes started from here. They import this module, which is complete by then.
        "tests.faults._change_process",
        "tests.faults._holding_process",
        "tests.faults._operator_process",
    ]
)


class ClientProcess:
    """``robolink ARGUMENTS`` as a process, with its output in two files.

    Args:
        arguments: The command line.
        environment: Added to this process's environment.
        folder: The folder of its output.
    """

    def __init__(
        self, arguments: Sequence[str], *, environment: Mapping[str, str], folder: Path
    ) -> None:
        self._out, self._err = folder / "client-stdout", folder / "client-stderr"
        self._process = _FORKS.Process(
            target=_robolink,
            args=(list(arguments), dict(environment), str(self._out), str(self._err)),
        )
        self._process.start()

    def signal(self, number: signal.Signals) -> None:
        """Send it a signal."""
        assert self._process.pid is not None
        os.kill(self._process.pid, number)

    def kill(self) -> None:
        """Send SIGKILL; return when the process and its socket are gone."""
        self.signal(signal.SIGKILL)
        assert wait([self._process.sentinel], PATIENCE_S), "it outlived SIGKILL"

    def exit_code(self) -> int:
        """Wait for its end and return the exit code, negative for a signal."""
        assert wait([self._process.sentinel], PATIENCE_S), f"it hangs; {self.err}"
        self._process.join()
        code = self._process.exitcode
        self._process.close()
        assert code is not None
        return code

    @property
    def out(self) -> str:
        """Its stdout."""
        return self._out.read_text()

    @property
    def err(self) -> str:
        """Its stderr."""
        return self._err.read_text()


def _robolink(
    arguments: list[str], environment: Mapping[str, str], out_path: str, err_path: str
) -> None:
    os.environ.update(environment)
    for number, path in ((1, out_path), (2, err_path)):
        os.dup2(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), number)
    from robolink_cli.main import run

    sys.exit(run(arguments, last=True))
