"""Running a history: on a disk in memory, with nothing of it left, and nothing grown."""

import gc
import os
import shutil
import tempfile
import threading
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, suppress
from pathlib import Path
from unittest import mock

from robolink_simulators.soak.cell import VirtualCell
from robolink_simulators.soak.history import History
from robolink_simulators.soak.story import Story


def live_through(history: History, replacements: Mapping[str, object] | None = None) -> Story:
    """Run a history on a disk in memory, where there is one; nothing of it stays.

    Args:
        history: What happens.
        replacements: Put in the place of what is found under a dotted name, for as long as it
            takes: defects that the rules have to find.
    """
    memory = Path("/dev/shm")
    folder = Path(tempfile.mkdtemp(prefix="soak-", dir=memory if memory.is_dir() else None))
    try:
        with ExitStack() as stack:
            for name, replacement in (replacements or {}).items():
                stack.enter_context(mock.patch(name, replacement))
            before = _held()
            story = VirtualCell(history, folder).run()
            grown = [f"{name}: {was} before, {now}" for name, was, now in _grown(before)]
            story.checks["NothingGrows"] += 1
            if grown:
                story.break_rule("NothingGrows", ", ".join(grown))
            return story
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _held() -> dict[str, int]:
    """Return how many threads and open files this process has, where that can be counted."""
    held = {"threads": threading.active_count()}
    with suppress(OSError):
        held["open files"] = len(os.listdir("/proc/self/fd"))
    return held


def _grown(before: Mapping[str, int]) -> Iterator[tuple[str, int, int]]:
    """Yield what there is more of than before."""
    if all(now <= before[name] for name, now in _held().items()):
        return
    gc.collect()  # a connection that was dropped in the middle is closed when it is collected
    for name, now in _held().items():
        if now > before[name]:
            yield name, before[name], now
