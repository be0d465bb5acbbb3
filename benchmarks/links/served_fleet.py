"""Serves many simulated EPSON controllers in one process: ``python -m ... COUNT``.

The first line on standard output says how long they took to open, what each takes and where they
are; every line on standard input is answered with what each takes by then.
"""

import json
import sys
from time import perf_counter

from robolink_simulators.epson import EpsonSimulator
from robolink_simulators.hosting.garbage import RareFullCollections
from robolink_simulators.hosting.streams.epson import serve_tcp


def main(count: int) -> None:
    """Serve so many until standard input ends."""
    allow_descriptors()
    # As `robolink sim` does. The extra cost of a process's first one is not counted for each.
    with RareFullCollections(), serve_tcp(EpsonSimulator()):
        before_kib, start = resident_kib(), perf_counter()
        hosts = [serve_tcp(EpsonSimulator(seed=seed)) for seed in range(count)]
        opened_s = perf_counter() - start
        said: dict[str, object] = {"seconds": opened_s, "urls": [host.url for host in hosts]}
        while True:
            said["kib_each"] = (resident_kib() - before_kib) / count
            print(json.dumps(said), flush=True)
            if not sys.stdin.readline():
                break
        for host in hosts:
            host.close()


def resident_kib(pid: int | str = "self") -> float:
    """Return how much memory of a process is resident, by the kernel's own account."""
    with open(f"/proc/{pid}/smaps_rollup", encoding="ascii") as lines:
        return float(next(line for line in lines if line.startswith("Rss:")).split()[1])


def allow_descriptors() -> None:
    """Take as many open files as this user may have."""
    import resource

    _, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (most, most))


if __name__ == "__main__":
    main(int(sys.argv[1]))
