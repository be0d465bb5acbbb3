"""A temporary PostgreSQL server on loopback for the tests."""

import os
import shutil
import signal
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from uuid import uuid4

from tests._ports import free_port

_NOBODY = 65534  # PostgreSQL refuses to run as root
_MEMORY = "/dev/shm"
_START_S = 30.0

ASKED_FOR_PASSWORD = "locked_out"
"""A role, made by the test that needs it, that the server asks for its password."""


def is_installed() -> bool:
    """Whether a server can be started here."""
    return shutil.which("initdb") is not None and shutil.which("postgres") is not None


@dataclass
class Server:
    """A PostgreSQL server.

    Attributes:
        folder: The folder of its data.
        port: Its port on 127.0.0.1.
    """

    folder: Path
    port: int
    process: subprocess.Popen[bytes] | None = None

    def url(self, database: str = "postgres") -> str:
        """Return the URL of a journal in one of its databases."""
        return f"postgresql+psycopg://journal@127.0.0.1:{self.port}/{database}"

    def empty_place(self) -> str:
        """Return the URL of an empty journal in a schema of its own."""
        name = f"j{uuid4().hex}"
        asked(self.url(), f"CREATE SCHEMA {name}")
        return f"{self.url()}?options=-csearch_path%3D{name}"

    def empty_database(self) -> str:
        """Return the URL of a new database."""
        name = f"d{uuid4().hex}"
        self.execute(f"CREATE DATABASE {name}")
        return self.url(name)

    def execute(self, statement: str, database: str = "postgres") -> None:
        """Run statements outside any journal."""
        asked(self.url(database), statement)

    def start(self) -> None:
        """Start it and wait until it answers."""
        log = (self.folder / "log").open("ab")
        self.process = _run_as_nobody(
            ["postgres", "-D", str(self.folder / "data"), "-p", str(self.port)], log.fileno()
        )
        log.close()
        deadline = time.monotonic() + _START_S
        while not self._answers():
            assert self.process.poll() is None, (self.folder / "log").read_text()
            assert time.monotonic() < deadline, "PostgreSQL did not start"
            time.sleep(0.02)

    def stop(self) -> None:
        """Stop the server at once, as an administrator's fast shutdown does."""
        assert self.process is not None
        _hang_up()
        self.process.send_signal(2)
        self.process.wait(timeout=_START_S)

    @contextmanager
    def closed(self, url: str) -> Iterator[None]:
        """Cut the connections to a database, which takes none during the block."""
        name = url.rpartition("/")[2]
        asked(self.url(), f"ALTER DATABASE {name} ALLOW_CONNECTIONS false")
        asked(
            self.url(),
            f"SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE datname = '{name}'",
        )
        try:
            yield
        finally:
            asked(self.url(), f"ALTER DATABASE {name} ALLOW_CONNECTIONS true")

    def crash(self) -> None:
        """End it at once, so that it recovers at its next start."""
        assert self.process is not None
        _hang_up()
        self.process.send_signal(signal.SIGQUIT)
        self.process.wait(timeout=_START_S)

    def _answers(self) -> bool:
        import psycopg

        try:
            self.execute("SELECT 1")
        except psycopg.OperationalError:
            return False
        return True


_connections: dict[str, Any] = {}


def asked(url: str, query: str) -> list[tuple[Any, ...]]:
    """Run statements outside any journal, over one connection for each database; return rows."""
    import psycopg

    known = _connections.get(url)
    if known is None or known.closed:
        known = psycopg.connect(url.replace("+psycopg", ""), autocommit=True)
        _connections[url] = known
    found = known.execute(query.encode())
    return found.fetchall() if found.description else []


def _hang_up() -> None:
    """Close these connections: their server is about to end."""
    while _connections:
        _connections.popitem()[1].close()


@contextmanager
def served() -> Iterator[Server]:
    """Run a server during the block; its data is in memory where that of the tests is."""
    # A new database takes 0.03 s of CPU there and 0.03 to 0.18 s on a disk. Another folder of the
    # tests may be closed to who runs the server.
    memory = _MEMORY if os.environ.get("PYTEST_DEBUG_TEMPROOT") == _MEMORY else None
    folder = Path(tempfile.mkdtemp(prefix="robolink-postgresql-", dir=memory))
    try:
        if os.geteuid() == 0:
            os.chown(folder, _NOBODY, _NOBODY)
        made = _run_as_nobody(
            ["initdb", "-D", str(folder / "data"), "-U", "journal", "-A", "trust", "--no-sync"],
            subprocess.DEVNULL,
        )
        assert made.wait(timeout=_START_S) == 0
        with (folder / "data" / "postgresql.conf").open("a") as settings:
            settings.write("listen_addresses = '127.0.0.1'\nfsync = off\n")
            # Each new database would get a worker of its own every minute.
            settings.write("autovacuum = off\n")
            settings.write(f"unix_socket_directories = '{folder}'\n")
        trust = folder / "data" / "pg_hba.conf"
        asking = f"host all {ASKED_FOR_PASSWORD} 127.0.0.1/32 scram-sha-256\n"
        trust.write_text(asking + trust.read_text())
        server = Server(folder, free_port())
        server.start()
        try:
            yield server
        finally:
            server.stop()
    finally:
        shutil.rmtree(folder)


def _run_as_nobody(command: list[str], output: int) -> subprocess.Popen[bytes]:
    if os.geteuid() != 0:
        return subprocess.Popen(command, stdout=output, stderr=output, cwd="/")
    return subprocess.Popen(
        command,
        stdout=output,
        stderr=output,
        cwd="/",
        user=_NOBODY,
        group=_NOBODY,
        extra_groups=[],
    )
