"""Which CPU client and simulator have, where there are two: a controller is another computer."""

import os
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def a_cpu_each() -> Iterator[int | None]:
    """Keep this process on one CPU for the block.

    Yields:
        Another CPU, for the simulator; ``None`` where there is none, or none can be chosen.
    """
    cpus = sorted(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else []
    if len(cpus) < 2:
        yield None
        return
    os.sched_setaffinity(0, {cpus[0]})
    try:
        yield cpus[1]
    finally:
        os.sched_setaffinity(0, set(cpus))
