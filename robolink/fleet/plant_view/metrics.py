"""Metrics of a plant for Prometheus: read from what is on record, no controller is asked.

Each scrape looks once into the plant's database, and waits for it no longer than a limit. A
database that hangs has one look hanging, however many scrapes come: they are answered with
``robolink_plant_up 0`` and what the agent knows of itself.
"""

import math
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from datetime import datetime
from socketserver import ThreadingMixIn
from typing import TYPE_CHECKING, Any, Final
from wsgiref.simple_server import WSGIRequestHandler, WSGIServer

from robolink import runtime
from robolink.errors import ConfigError, RobolinkError
from robolink.fleet.plant_view.cell_states import BOUNDS_MM, COUNTED
from robolink.fleet.plant_view.notes import PlantLook
from robolink.fleet.states import JobState
from robolink.messages import tr
from robolink.timing import wall_time

if TYPE_CHECKING:
    from prometheus_client import Metric

LIMIT_S: Final = 3.0
"""Longest wait of a scrape for the plant's database, s."""

MOST_AT_ONCE: Final = 16
"""Connections at once; a further one is closed."""

SILENT_S: Final = 5.0
"""After so long without a byte a connection is closed, s."""

LONGEST_S: Final = 15.0
"""How long a connection lives at most, s."""


class SharedLook:
    """Looks into a plant's database for all who ask, one look at a time.

    Args:
        look: Looks; it may hang, and raises RobolinkError where it cannot look.
    """

    def __init__(self, look: Callable[[], PlantLook]) -> None:
        self._look = look
        self._lock = threading.Lock()
        self._running: _Running | None = None

    def within(self, limit_s: float) -> PlantLook | None:
        """Return what is on record now.

        Args:
            limit_s: Longest wait, s.

        Returns:
            ``None`` where the database cannot be used, or does not answer in time.
        """
        with self._lock:
            if self._running is None:
                self._running = _Running(self._look, self._ended)
            running = self._running
        running.over.wait(limit_s)
        return running.found

    def _ended(self) -> None:
        with self._lock:
            self._running = None


class _Running:
    """One look, in a thread that ends with the process."""

    def __init__(self, look: Callable[[], PlantLook], ended: Callable[[], None]) -> None:
        self.over = threading.Event()
        self.found: PlantLook | None = None
        self._look, self._ended = look, ended
        threading.Thread(target=self._run, name="look at the plant", daemon=True).start()

    def _run(self) -> None:
        try:
            self.found = self._look()
        except RobolinkError:
            pass  # what a plant that is not up is called in metrics: 0
        finally:
            self._ended()
            self.over.set()


class PlantMetrics:
    """Collects the metrics of a plant; a collector for a registry of ``prometheus_client``.

    Args:
        look: Looks into the plant's database.
        turned_s: Returns when the agent had its last turn at which the database answered, seconds
            since 1970; 0 before the first.
        limit_s: Longest wait for the database, s.
        clock: Returns the time, with its zone.
    """

    def __init__(
        self,
        look: Callable[[], PlantLook],
        turned_s: Callable[[], float],
        *,
        limit_s: float = LIMIT_S,
        clock: Callable[[], datetime] = wall_time,
    ) -> None:
        self._turned_s = turned_s
        self._shared, self._limit_s, self._clock = SharedLook(look), limit_s, clock

    def describe(self) -> "Iterator[Metric]":
        """Yield nothing: a registry need not look at the database when it gets this collector."""
        yield from ()

    def collect(self) -> "Iterator[Metric]":
        """Yield all metrics as of now."""
        from prometheus_client.core import GaugeMetricFamily

        yield GaugeMetricFamily(
            "robolink_agent_turn_timestamp_seconds",
            "When the agent had its last turn at which the plant's database answered.",
            value=self._turned_s(),
        )
        found = self._shared.within(self._limit_s)
        yield GaugeMetricFamily(
            "robolink_plant_up",
            "Whether the plant's database answered this scrape.",
            value=0 if found is None else 1,
        )
        if found is not None:
            yield from self._cells(found)
            yield from _plans(found)

    def _cells(self, found: PlantLook) -> "Iterator[Metric]":
        from prometheus_client.core import (
            CounterMetricFamily,
            GaugeMetricFamily,
            HistogramMetricFamily,
        )

        unsettled = GaugeMetricFamily(
            "robolink_unsettled",
            "Whether a job at the cell was begun and is not proved finished.",
            labels=["cell"],
        )
        age = GaugeMetricFamily(
            "robolink_check_age_seconds",
            "Time since the last check, also one that failed; +Inf without one.",
            labels=["cell"],
        )
        well = GaugeMetricFamily(
            "robolink_check_well",
            "Whether the last check could be made and found nothing.",
            labels=["cell"],
        )
        noted = GaugeMetricFamily(
            "robolink_note_age_seconds",
            "Time since the cell's home noted how it stands, every ten minutes at least.",
            labels=["cell"],
        )
        changes = CounterMetricFamily(
            "robolink_changes",
            "Changes of a tool on record, by how they ended.",
            labels=["cell", "outcome"],
        )
        corrections = [0] * (len(BOUNDS_MM) + 1)
        moved_mm = 0.0
        for cell, state in found.cells.items():
            unsettled.add_metric([cell], bool(state.unsettled_since))
            noted.add_metric([cell], self._age_s(state.noted_at))
            age.add_metric([cell], self._age_s(state.checked_at) if state.checked_at else math.inf)
            if state.well is not None:
                well.add_metric([cell], state.well)
            for outcome in COUNTED.values():
                if count := state.changes.get(outcome, 0):
                    changes.add_metric([cell, outcome], count)
            corrections = [a + b for a, b in zip(corrections, state.corrections, strict=True)]
            moved_mm += state.moved_mm
        yield from (unsettled, age, well, noted, changes)
        buckets, total = list[tuple[str, float]](), 0
        for bound, count in zip((*map(str, BOUNDS_MM), "+Inf"), corrections, strict=True):
            total += count
            buckets.append((bound, total))
        yield HistogramMetricFamily(
            "robolink_correction_mm",
            "How far kept changes moved the stored tip.",
            buckets=buckets,
            sum_value=moved_mm,
        )
        if found.behind_count is not None:
            yield GaugeMetricFamily(
                "robolink_outbox_entries",
                "Entries of the cells' journals that the plant has no copy of yet.",
                value=found.behind_count,
            )

    def _age_s(self, at: str) -> float:
        """Return how old a label is; not less than nothing where a clock was set back."""
        return max(0.0, (self._clock() - datetime.fromisoformat(at)).total_seconds())


def _plans(found: PlantLook) -> "Iterator[Metric]":
    from prometheus_client.core import GaugeMetricFamily

    jobs = GaugeMetricFamily(
        "robolink_jobs",
        "Jobs of the newest plans, and of those that are not finished.",
        labels=["plan", "kind", "state"],
    )
    halted = GaugeMetricFamily(
        "robolink_plan_halted", "A plan that a rule or a person halted.", labels=["plan", "rule"]
    )
    for plan in found.plans:
        for state in JobState:
            if state in plan.counts:
                jobs.add_metric([plan.id, plan.kind, str(state)], plan.counts[state])
        if not plan.finished:
            for rule in dict.fromkeys(str(halt.rule) for halt in plan.standing):
                halted.add_metric([plan.id, rule], 1)
    yield from (jobs, halted)


class _Handler(WSGIRequestHandler):
    """Answers one request, and logs nothing."""

    timeout = SILENT_S

    def handle(self) -> None:
        """Answer it; who is silent or gone gets no answer."""
        with suppress(OSError):
            super().handle()

    def log_message(self, format: str, *args: object) -> None:
        """Log nothing."""


class _Server(ThreadingMixIn, WSGIServer):
    """A thread for each connection, of which there are few and each for a short time.

    Args:
        address: Family and address to listen on.
        app: What answers.
    """

    daemon_threads = True
    request_queue_size = 64

    def __init__(self, address: tuple[socket.AddressFamily, Any], app: Callable[..., Any]) -> None:
        self.address_family, where = address
        self._open: dict[Any, int] = {}
        super().__init__(where, _Handler)
        self.set_app(app)

    def process_request(self, request: Any, client_address: Any) -> None:  # noqa: ANN401
        """Answer a connection in a thread, if there is room for it."""
        if len(self._open) >= MOST_AT_ONCE:
            self.shutdown_request(request)
            return
        self._open[request] = runtime.monotonic_ns()
        super().process_request(request, client_address)

    def shutdown_request(self, request: Any) -> None:  # noqa: ANN401
        """Close a connection, with which its place is free."""
        super().shutdown_request(request)
        self._open.pop(request, None)

    def service_actions(self) -> None:
        """End connections that last too long; called now and then."""
        oldest_ns = runtime.monotonic_ns() - LONGEST_S * 1e9
        for request, since_ns in tuple(self._open.items()):
            if since_ns < oldest_ns:
                with suppress(OSError):
                    request.shutdown(socket.SHUT_RDWR)  # its thread sees the end


@contextmanager
def metrics_served(host: str, port: int, metrics: PlantMetrics) -> Iterator[str]:
    """Serve the metrics of a plant to Prometheus within a block; yield their URL.

    Args:
        host: Address to listen on.
        port: Port; 0 takes a free one.
        metrics: The metrics.

    Raises:
        ConfigError: Nothing can listen there.
    """
    from prometheus_client import CollectorRegistry, make_wsgi_app

    registry = CollectorRegistry(auto_describe=False)
    registry.register(metrics)
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
        server = _Server((found[0][0], found[0][4]), make_wsgi_app(registry))
    except OSError as error:
        raise ConfigError(
            tr(
                "Nothing can listen on {host}:{port}: {cause}.",
                host=host,
                port=port,
                cause=error.strerror or error,
            ),
            remedy=tr("Give another address, or end the program that listens there."),
        ) from error
    thread = threading.Thread(target=server.serve_forever, name="metrics", daemon=True)
    thread.start()
    try:
        shown = f"[{host}]" if ":" in host else host
        yield f"http://{shown}:{server.server_port}/metrics"
    finally:
        server.shutdown()
        server.server_close()
        thread.join()
