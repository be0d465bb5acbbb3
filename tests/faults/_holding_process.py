"""A process that carries out an order up to a point and waits there, to be frozen or let go on."""

import os
import signal
import sys
import time
from multiprocessing.connection import Connection
from pathlib import Path

import robolink
from robolink.errors import RobolinkError
from robolink.journal import open_journal
from robolink.journal._lease_view import BootClock
from robolink.model import Signature, ToolOffset
from robolink.stopping import StopListener
from robolink.timing import NS_PER_S
from robolink.transaction import ToolChange, Wanted, carrying_out
from tests._patience import PATIENCE_S
from tests.faults import _client_process


class EarlierClock(BootClock):
    """The time since the start of the system some seconds ago: its beats are that old."""

    def __init__(self, earlier_s: float) -> None:
        self._earlier_ns = round(earlier_s * NS_PER_S)

    def now_ns(self) -> int:
        return super().now_ns() - self._earlier_ns


class HoldingProcess:
    """Has an order half-way: the tool is written, and its change is open.

    Args:
        url: The controller.
        folder: Its state folder.
        order: The order and its job.
        new: The value of tool 1.
        silent_s: For how long it counts as silent at once.
        begun: Whether it waits inside the order; else it waits before, logged in without the lease.
    """

    def __init__(
        self,
        url: str,
        folder: Path,
        order: tuple[str, dict[str, object]],
        new: ToolOffset,
        *,
        silent_s: float = 0.0,
        begun: bool = True,
    ) -> None:
        forks = _client_process._FORKS
        self._line, far_end = forks.Pipe()
        task = (url, str(folder), order, new, silent_s, begun)
        self._process = forks.Process(target=_hold, args=(far_end, task))
        self._process.start()
        far_end.close()
        assert self._line.poll(PATIENCE_S), "he hangs"
        assert self._line.recv() == "waits"

    @property
    def pid(self) -> int:
        assert self._process.pid is not None
        return self._process.pid

    @property
    def exit_code(self) -> int | None:
        """The exit code, negative for a signal; ``None`` while it runs."""
        self._process.join(0)
        return self._process.exitcode

    def freeze(self) -> None:
        """Send SIGSTOP; return when it is stopped, for only then it is silent."""
        os.kill(self.pid, signal.SIGSTOP)
        deadline = time.monotonic() + PATIENCE_S
        while _state(self.pid) != "T":
            assert time.monotonic() < deadline, "it goes on"
            time.sleep(0.002)

    def thaw(self) -> None:
        """Send SIGCONT."""
        os.kill(self.pid, signal.SIGCONT)

    def goes_on(self) -> str:
        """Let it go on to its end; return how it ended."""
        self._line.send(None)
        assert self._line.poll(PATIENCE_S), "it hangs"
        said: str = self._line.recv()
        self._process.join(PATIENCE_S)
        return said

    def close(self) -> None:
        """End it, whatever its state."""
        self._process.kill()
        self._process.join()
        self._line.close()


def _state(pid: int) -> str:
    return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]


def _hold(
    line: Connection,
    task: tuple[str, str, tuple[str, dict[str, object]], ToolOffset, float, bool],
) -> None:
    url, folder, order, new, silent_s, begun = task
    os.environ["ROBOLINK_STATE_DIR"] = folder
    outcomes = open_journal().log(
        url, signature=Signature(operator="Ann Lee"), clock=EarlierClock(silent_s)
    )

    def waits() -> None:
        line.send("waits")
        line.recv()

    try:
        with (
            robolink.connect(url, outcomes=outcomes) as controller,
            StopListener(controller, url, who="Ann Lee ('robolink change')"),
        ):
            if not begun:
                waits()
            with carrying_out(controller, *order) as found:
                wanted = [Wanted(1, new, controller.tools.read(1))]
                with ToolChange(
                    controller, wanted, order=found, describe=lambda _made: {"skipped": False}
                ) as change:
                    change.write()
                    if begun:
                        waits()
                    change.keep()
    except (RobolinkError, KeyboardInterrupt) as error:
        line.send(type(error).__name__)
    else:
        line.send("done")
    sys.exit(0)
