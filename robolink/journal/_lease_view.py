"""Who holds a lease, whether that process is alive, and a lease as it was read.

A PLC knows the owner of its mailbox by a token and nothing else. So each run that takes one
leaves a small file in the state folder, before it asks, and removes it when it has given the
mailbox back: after a kill the next run finds whose the token is. It need not outlive the power,
because after that the ten seconds of silence have passed.
"""

import json
import os
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass
from functools import lru_cache
from pathlib import Path
from typing import Final

from robolink import runtime
from robolink.errors import LeaseHeldError
from robolink.files.durable import make_folder, state_folder
from robolink.journal._homes import this_computer
from robolink.messages import tr
from robolink.model import ClientRun, EntryKind, NewEntry, Signature
from robolink.remedy_words import RemedyWord, remedy_word
from robolink.timing import local_label, wall_label

_DEAD_STATES: Final = ("Z", "X")
_USER_VARIABLES: Final = ("LOGNAME", "USER", "LNAME", "USERNAME")
"""Variables that ``getpass`` reads, in its order."""


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
        """Whether this process knows for certain that ``other`` has ended.

        A container has process numbers of its own, so only the same PID namespace counts.
        """
        _, _, start = other.process_start.partition(" ")
        return self.can_tell(other) and _has_ended(other.pid, start)

    def knows_to_run(self, other: "LeaseHolder") -> bool:
        """Whether ``other`` is another process, and known to run."""
        return self.pid != other.pid and self.can_tell(other) and not self.proves_gone(other)

    def can_tell(self, other: "LeaseHolder") -> bool:
        """Whether this process can find out if ``other`` still runs."""
        namespace, _, start = other.process_start.partition(" ")
        if not self.shares_clock_with(other) or not start:
            return False
        return namespace == self.process_start.partition(" ")[0]


class BootClock:
    """Time since the start of the system, the same in all its processes, asleep or not."""

    def now_ns(self) -> int:
        """Return the nanoseconds since the system was started."""
        return runtime.boot_ns()

    def sleep(self, seconds: float) -> None:
        """Block the calling thread."""
        if seconds > 0:
            runtime.sleep(seconds)


def this_process(operator: str = "") -> LeaseHolder:
    """Return this process as the holder of a lease."""
    pid = os.getpid()
    process_start, boot = _start_and_boot(pid)
    return LeaseHolder(
        os_user=_os_user(*map(os.environ.get, _USER_VARIABLES)),
        host=this_computer(),
        pid=pid,
        process_start=process_start,
        boot=boot,
        operator=operator,
    )


@lru_cache(maxsize=1)
def _os_user(*_said: str | None) -> str:
    """Return the user by environment or system; the system is not asked for each cell of many.

    Args:
        _said: What the variables say that go before the system.
    """
    import getpass

    try:
        return getpass.getuser()
    except (OSError, KeyError, ImportError):
        return ""  # a container may run under a user number without a name


@lru_cache(maxsize=1)
def _start_and_boot(pid: int) -> tuple[str, str]:
    """Return what identifies this process and stays the same; a fork has another pid."""
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
    # Ask the system first: /proc may be mounted so that it hides processes of other users.
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
    # The name is in parentheses and may contain any character (proc(5)); field 3 follows it.
    fields = text.rpartition(")")[2].split()
    return fields[0], fields[19]


def signature_here(version: str) -> Signature:
    """Return the user and the computer, with the version of this software."""
    here = this_process()
    return Signature(os_user=here.os_user, host=here.host, version=version)


LEASE_S: Final = 10.0
"""Time in s without a sign of life after which a holder may be replaced."""

FREE: Final = ""
"""Token of a lease without a holder."""


@dataclass(frozen=True, slots=True)
class LeaseView:
    """A lease as it was read.

    Attributes:
        epoch: How many holders there were; 0 for a lease that never was held.
        token: Id of the holder, empty when it is free.
        beat: Counter of the signs of life.
        beat_ns: The last one, in the holder's time since the start of his system.
        holder: The holder as JSON.
        taken_at: Since when, as a label.
        purpose: What for.
    """

    epoch: int = 0
    token: str = FREE
    beat: int = 0
    beat_ns: int = 0
    holder: str = "{}"
    taken_at: str = ""
    purpose: str = ""

    def who(self) -> LeaseHolder:
        """Return the holder, an unknown one if its record is damaged."""
        try:
            return LeaseHolder(**json.loads(self.holder))
        except (ValueError, TypeError, RecursionError):
            return LeaseHolder()

    def held_error(self, controller: str, last_sign: str) -> LeaseHeldError:
        """Return the error that names the holder.

        Args:
            controller: Whose lease it is.
            last_sign: When the holder gave its last sign of life, in words.
        """
        return LeaseHeldError(
            tr(
                "{holder} has locked {controller} since {since}: {purpose}. Last response: {sign}.",
                holder=describe_holder(self.who()),
                controller=controller,
                since=local_label(self.taken_at),
                purpose=self.purpose,
                sign=last_sign,
            ),
            remedy=tr(
                "Nothing was sent. Wait ({wait}), or take over after {seconds:.0f} s of silence.",
                wait=remedy_word(RemedyWord.WAIT),
                seconds=LEASE_S,
            ),
            controller=controller,
        )

    def silent_error(self, controller: str, silent_s: float) -> LeaseHeldError:
        """Return the error that names a holder whose process runs and does not respond.

        Args:
            controller: Whose lease it is.
            silent_s: For how long it has been silent, s.
        """
        return LeaseHeldError(
            tr(
                "{holder} has locked {controller} since {since}: {purpose}. Its process still "
                "runs, but has not responded for {seconds:.0f} s.",
                holder=describe_holder(self.who()),
                controller=controller,
                since=local_label(self.taken_at),
                purpose=self.purpose,
                seconds=silent_s,
            ),
            remedy=tr(
                "Nothing was sent. Look at the robot. Then stop it and end that program: {end}.",
                end=remedy_word(RemedyWord.END_HOLDER),
            ),
            controller=controller,
        )

    def at_work(self, alive: str) -> str:
        """Return the sentences about a holder who is working.

        Args:
            alive: Whether he lives, one sentence.
        """
        said = tr(
            "{holder} has had this controller locked since {since}: {purpose}.",
            holder=describe_holder(self.who()),
            since=local_label(self.taken_at),
            purpose=self.purpose,
        )
        return f"{said} {alive}"

    def took_over(self, controller: str) -> str:
        """Return the sentence about the present holder, or the last one.

        Args:
            controller: Whose lease it is.
        """
        if self.who() == LeaseHolder():
            return tr("Somebody else took over {controller} meanwhile.", controller=controller)
        return tr(
            "{holder} took over {controller} on {since}: {purpose}.",
            holder=describe_holder(self.who()),
            controller=controller,
            since=local_label(self.taken_at),
            purpose=self.purpose,
        )

    def taken_entry(self, because: str, insisting: LeaseHolder | None = None) -> NewEntry:
        """Return the record of a lease that another ended.

        Args:
            because: Why that could be done, in words.
            insisting: The person who had it ended, whoever held it; ``None`` where nobody
                had to insist.
        """
        if self.token == FREE:
            verdict = tr("Nobody had this controller locked; {because}.", because=because)
        else:
            holder = describe_holder(self.who())
            verdict = (
                tr(
                    "{holder} had this controller locked before: {because}.",
                    holder=holder,
                    because=because,
                )
                if insisting is None
                else tr(
                    "{insisting} took over this controller from {holder}: {because}.",
                    insisting=describe_holder(insisting),
                    holder=holder,
                    because=because,
                )
            )
        details = {
            "epoch": self.epoch + 1,
            "holder": asdict(self.who()),
            "since": self.taken_at,
            "purpose": self.purpose,
            "reason": because,
            **({} if insisting is None else {"insisted": asdict(insisting)}),
        }
        return NewEntry(EntryKind.LEASE, verdict=verdict, details=details)

    def is_like(self, other: "LeaseView") -> bool:
        """Whether nothing happened between two reads."""
        return (self.epoch, self.token, self.beat) == (other.epoch, other.token, other.beat)


def describe_holder(holder: LeaseHolder) -> str:
    """Return who it is, for display."""
    if holder == LeaseHolder():
        return tr("Somebody unknown")
    process = tr("process {pid} on {host}", pid=holder.pid, host=holder.host)
    if holder.operator and holder.operator != holder.os_user:
        return tr(
            "{operator} ({os_user}, {process})",
            operator=holder.operator,
            os_user=holder.os_user,
            process=process,
        )
    return tr("{os_user} ({process})", os_user=holder.os_user or "?", process=process)


_SCHEMA: Final = "robolink/mailbox-client/1"
_KEPT_S: Final = 86_400.0
"""Shortest time in s for which the file of a run that ended without removing it is kept."""


def note_client(client: str, holder: LeaseHolder) -> None:
    """Note whose a token is before it takes a mailbox; a full state folder does not matter."""
    known = {"schema": _SCHEMA, "client": client, "holder": asdict(holder), "since": wall_label()}
    with suppress(OSError):
        path = _path(client)
        make_folder(path.parent)
        for old in _outdated(path.parent):
            old.unlink(missing_ok=True)
        draft = path.with_suffix(".new")
        descriptor = os.open(draft, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
        with open(descriptor, "w", encoding="utf-8") as file:
            json.dump(known, file)
        os.replace(draft, path)


def forget_client(client: str) -> None:
    """Forget a token: the mailbox was released, or never taken."""
    with suppress(OSError):
        _path(client).unlink(missing_ok=True)


def run_of(client: str, here: LeaseHolder) -> ClientRun | None:
    """Return the run whose token this is, ``None`` for one that was not noted here.

    Args:
        client: The token.
        here: This process, which judges whether the other still lives.
    """
    try:
        known = json.loads(_path(client).read_bytes())
        holder, since = LeaseHolder(**known["holder"]), str(known["since"])
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return None
    if here.proves_gone(holder):
        return ClientRun(describe_holder(holder), since, lives=False)
    # This process too: an earlier session of it may have ended, which is not known here.
    lives = True if here.can_tell(holder) and holder != here else None
    return ClientRun(describe_holder(holder), since, lives=lives)


def _outdated(folder: Path) -> Iterator[Path]:
    for path in folder.iterdir():
        with suppress(OSError):
            if runtime.wall_s() - path.stat().st_mtime > _KEPT_S:
                yield path


def _path(client: str) -> Path:
    # Eight hexadecimal digits; other text could name a file that is not ours.
    name = client if client.isalnum() else "unreadable"
    return state_folder("clients") / f"{name}.json"
