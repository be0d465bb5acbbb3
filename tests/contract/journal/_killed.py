"""Runs work on a journal repeatedly; each run is killed some statements later than the last.

Arguments: the path of the journal; ``again`` to do the steps of a tool write in it or ``anew`` to
make a journal for each run; and how many statements later. For each run one line on stdout says how
many steps were acknowledged before the process was killed; the last run completes. Each run is a
forked process; where there is no fork, as on Windows, it is a started one, with the run's number as
its fourth argument.
"""

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from itertools import count

from robolink.journal import JournalOutcomeLog, close_files, open_journal
from robolink.journal.store.connection import DatabaseConnection
from robolink.model import EntryKind, NewEntry
from tests.contract.journal._acts import marker

# On Windows os.kill ends a process by TerminateProcess, whatever signal it is given.
KILL = getattr(signal, "SIGKILL", signal.SIGTERM)

STEPS: tuple[Callable[[JournalOutcomeLog], None], ...] = (
    lambda log: log.look(),
    lambda log: log.begin(marker("a")),
    lambda log: log.clear("a", *(NewEntry(kind) for kind in list(EntryKind)[1:4])),
    lambda log: log.append(NewEntry(EntryKind.VERIFY)),
    lambda log: log.begin(marker("b")),
)


def kill_at(number: int) -> None:
    """Kill this process before its statement or commit of that number."""
    left = number

    def step(*_told: object) -> None:
        nonlocal left
        left -= 1
        if left == 0:
            os.kill(os.getpid(), KILL)

    for name in ("run", "run_many", "rows", "commit"):
        setattr(DatabaseConnection, name, _after(step, getattr(DatabaseConnection, name)))


def _after(step: Callable[[], None], run: Callable[..., object]) -> Callable[..., object]:
    def stepped(*arguments: object) -> object:
        step()
        return run(*arguments)

    return stepped


def run_once(number: int, acknowledge: int, location: str) -> None:
    """Do all steps, killed at statement ``number``; each completed step writes a byte to a pipe."""
    log = open_journal(location).log(f"cell-{number}")
    kill_at(number)
    for step in STEPS:
        step(log)
        os.write(acknowledge, b".")


def make_once(number: int, location: str) -> None:
    """Make a new journal, killed at statement ``number``."""
    kill_at(number)
    open_journal(f"{location}-{number}")


def load_all(location: str) -> None:
    """Load and compile everything that a run needs, so that all runs begin alike."""
    log = open_journal(location).log("cell-0")
    for step in STEPS:
        step(log)
    close_files()


def killed_in_a_fork(number: int, location: str, anew: bool) -> tuple[int, bool]:
    """Run once in a fork; return the number of acknowledged steps and whether the run completed."""
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        if anew:
            make_once(number, location)
        else:
            run_once(number, writer, location)
        os._exit(0)
    os.close(writer)
    with open(reader, "rb") as pipe:
        acknowledged = len(pipe.read())
    _, status = os.waitpid(child, 0)
    if os.WIFEXITED(status) and os.WEXITSTATUS(status):
        sys.exit(os.WEXITSTATUS(status))
    return acknowledged, os.WIFEXITED(status)


def killed_in_a_process(number: int, location: str, anew: bool) -> tuple[int, bool]:
    """Run once in a started process; return the same as :func:`killed_in_a_fork`."""
    how = "anew" if anew else "again"
    program = "tests.contract.journal._killed"
    command = (sys.executable, "-m", program, location, how, "1", str(number))
    done = subprocess.run(command, stdout=subprocess.PIPE, check=False)
    if done.returncode not in {0, KILL}:
        sys.exit(done.returncode)
    return done.stdout.count(b"."), done.returncode == 0


def main() -> None:
    """Run until one run completes, or only the run whose number is given."""
    location, anew, later = sys.argv[1], sys.argv[2] == "anew", int(sys.argv[3])
    if len(sys.argv) > 4:
        once = make_once if anew else partial(run_once, acknowledge=sys.stdout.fileno())
        once(int(sys.argv[4]), location=location)
        return
    load_all(f"{location}-0" if anew else location)
    run = killed_in_a_fork if hasattr(os, "fork") else killed_in_a_process
    for number in count(1, later):
        acknowledged, ended = run(number, location, anew)
        print(acknowledged, flush=True)  # noqa: T201 - this is what the test reads
        if ended:
            return


if __name__ == "__main__":
    main()
