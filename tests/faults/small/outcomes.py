"""Runs one after the other, each reported with its end."""

import gc
import os
import shutil
import signal
import tempfile
from collections import defaultdict
from collections.abc import Callable, Iterable
from typing import Final

from tests.faults.small.cells import Steps, calibrated, wired_cell
from tests.faults.small.faults_of_a_run import Pair, Planned, run_with
from tests.faults.small.judging import judge
from tests.faults.small.wire import SmallFault

_TERMINATED: Final = "exit 143"
_LONGEST_S: Final = 120
"""The longest time of one run, in real time: a longer one hangs."""


def outcome(run: Planned) -> str:
    """Make one run; return how it ended, or its fault."""
    return _told(lambda: run_with(run.kind, run.pair, run.fault))


def split_off(
    kind: str, runs: Iterable[Planned], tell: Callable[[Planned, str], None], *, jobs: int
) -> None:
    """Make runs of one calibration: each continues in a process of its own from its fault on.

    The part before the fault is the same in all of them and done once. Only for a process with one
    thread, and where there is ``fork``.

    Args:
        kind: The kind of controller.
        runs: The runs to make.
        tell: Called in each of the processes with its run and how it ended.
        jobs: The largest number of processes at a time.
    """
    waiting = defaultdict[Pair, list[Planned]](list)
    for run in runs:
        waiting[run.pair].append(run)
    steps, mine, children = Steps(), list[Planned](), set[int]()

    def on_request(request: bytes) -> SmallFault | None:
        if mine:
            return None
        for run in waiting.pop(Pair(cell.shape(request), steps.now), []):
            if len(children) >= jobs:
                children.remove(os.wait()[0])
            child = os.fork()
            if not child:
                mine.append(run)
                _take_a_folder_of_its_own()
                signal.alarm(_LONGEST_S)
                return run.fault
            children.add(child)
        return None

    gc.freeze()  # existing objects are not garbage; examining them would copy them in each process
    with wired_cell(kind) as cell:
        cell.wire.on_request = on_request
        how = _told(lambda: judge(cell, calibrated(cell, steps)), alarm=False)
        if mine:
            try:
                if _TERMINATED not in how:  # a signal to all of them ended it; the run is repeated
                    tell(mine[0], how)
                shutil.rmtree(os.environ["ROBOLINK_STATE_DIR"], ignore_errors=True)
            finally:
                os._exit(0)
    while children:
        children.remove(os.wait()[0])
    assert how == "done", how
    assert not waiting, f"never reached: {list(waiting)}"


def _told(run: Callable[[], str], *, alarm: bool = True) -> str:
    signal.signal(signal.SIGALRM, _hangs)
    signal.alarm(_LONGEST_S if alarm else 0)
    try:
        return run()
    except Exception as error:  # any error is reported, and the next run made
        return f"WRONG: {type(error).__name__}: {' '.join(str(error).split())[:400]}"
    finally:
        signal.alarm(0)


def _hangs(*_: object) -> None:
    raise TimeoutError("it hangs")


def _take_a_folder_of_its_own() -> None:
    """Copy the run's files so far into a folder of its own."""
    folder = tempfile.mkdtemp(prefix="robolink-small-")
    shutil.copytree(os.environ["ROBOLINK_STATE_DIR"], folder, dirs_exist_ok=True)
    os.environ["ROBOLINK_STATE_DIR"] = folder
