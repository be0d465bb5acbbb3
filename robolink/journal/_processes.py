"""Which process holds a lease, and whether it still lives."""

import os
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Final

from robolink import ambient
from robolink.model import Signature

_DEAD_STATES: Final = ("Z", "X")


@dataclass(frozen=True, slots=True)
class LeaseHolder:
    """Who holds a lease.

    Attributes:
        os_user: User of the operating system.
        host: Name of the computer.
        pid: Number of the process.
        process_start: Tells this process from a later one of the same number: its PID
            namespace and its start in clock ticks. Empty where the system does not say.
        boot: Id of this start of the system; empty where it has none.
        operator: Badge or name that the person gave.
    """

    os_user: str = ""
    host: str = ""
    pid: int = 0
    process_start: str = ""
    boot: str = ""
    operator: str = ""

    def shares_clock_with(self, other: "LeaseHolder") -> bool:
        """Whether both count the same time since the start of one system."""
        return self.boot != "" and self.boot == other.boot

    def proves_gone(self, other: "LeaseHolder") -> bool:
        """Whether this process can tell for certain that ``other`` has ended.

        A container has process numbers of its own, so only the same PID namespace counts.
        """
        _, _, start = other.process_start.partition(" ")
        return self.can_tell(other) and _has_ended(other.pid, start)

    def can_tell(self, other: "LeaseHolder") -> bool:
        """Whether this process can see at all whether ``other`` still runs."""
        namespace, _, start = other.process_start.partition(" ")
        if not self.shares_clock_with(other) or not start:
            return False
        return namespace == self.process_start.partition(" ")[0]


class BootClock:
    """Time since the start of the system, the same in all its processes, asleep or not."""

    def now_ns(self) -> int:
        """Return the nanoseconds since the system was started."""
        return ambient.boot_ns()

    def sleep(self, seconds: float) -> None:
        """Block the calling thread."""
        if seconds > 0:
            ambient.sleep(seconds)


def this_process(operator: str = "") -> LeaseHolder:
    """Return this process as the holder of a lease."""
    import getpass
    import platform

    try:
        os_user = getpass.getuser()
    except (OSError, KeyError, ImportError):
        os_user = ""  # a container may run under a number that has no name
    pid = os.getpid()
    process_start, boot = _start_and_boot(pid)
    return LeaseHolder(
        os_user=os_user,
        host=platform.node(),
        pid=pid,
        process_start=process_start,
        boot=boot,
        operator=operator,
    )


@lru_cache(maxsize=1)
def _start_and_boot(pid: int) -> tuple[str, str]:
    """Return what tells this process from others, which stays as it is; a fork has another pid."""
    found, namespace = _state_and_start(pid), _pid_namespace()
    return f"{namespace} {found[1]}" if found and namespace else "", _boot_id()


def _boot_id() -> str:
    try:
        return Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii").strip()
    except OSError:
        return ""


def _pid_namespace() -> str:
    try:
        return os.readlink("/proc/self/ns/pid")
    except OSError:
        return ""


def _has_ended(pid: int, start: str) -> bool:
    # The system is asked first: /proc may be mounted so that it hides others' processes.
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return True
    except OSError:
        pass
    found = _state_and_start(pid)
    return found is not None and (found[0] in _DEAD_STATES or found[1] != start)


def _state_and_start(pid: int) -> tuple[str, str] | None:
    try:
        text = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return None
    # The name stands in parentheses and may hold any character (proc(5)); field 3 follows.
    fields = text.rpartition(")")[2].split()
    return fields[0], fields[19]


def signature_here(version: str) -> Signature:
    """Return the user and the computer, with the version of this software."""
    here = this_process()
    return Signature(os_user=here.os_user, host=here.host, version=version)
