"""The metrics of a plant: read from the record, over a real socket, by the official parser."""

import math
import re
import select
import shutil
import socket
import subprocess
import threading
import time
from dataclasses import replace
from pathlib import Path
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import pytest
from prometheus_client.parser import text_string_to_metric_families

from robolink.errors import ConfigError
from robolink.fleet import CellState, FleetStore, JobOutcome, PlantNotes
from robolink.fleet.plant_view import metrics as served_metrics
from robolink.fleet.plant_view.metrics import PlantMetrics, metrics_served
from tests.fleet._plans import carried_out, cells_of, permitted, plan_with

NOTED = CellState(
    "epson:C-1/R-1",
    changes={"done": 3, "refused": 1},
    corrections=(0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 2),
    moved_mm=41.03,
    checked_at="2026-11-30T22:00:00+00:00",
    well=True,
)


class Scraped:
    """What a scrape found: values by name and labels."""

    def __init__(self, text):
        self.text = text
        self.values = {
            (sample.name, *sorted(sample.labels.values())): sample.value
            for family in text_string_to_metric_families(text)
            for sample in family.samples
        }
        self.names = {key[0] for key in self.values}

    def __getitem__(self, key):
        return self.values[key if isinstance(key, tuple) else (key,)]


def scraped(url):
    with urlopen(url, timeout=20) as answer:
        assert answer.headers["Content-Type"].startswith("text/plain")
        return Scraped(answer.read().decode())


@pytest.fixture
def notes(location, wall):
    with PlantNotes(location, "plant", clock=wall) as notes:
        yield notes


@pytest.fixture
def served(notes, wall):
    metrics = PlantMetrics(notes.look, lambda: 1764540000.0, clock=wall)
    with metrics_served("127.0.0.1", 0, metrics) as url:
        yield url


def test_what_is_noted_and_recorded_is_served(notes, served, location, wall):
    begun = replace(NOTED, unsettled_since="2026-11-30T20:00:00+00:00", changes={})
    begun = replace(begun, checked_at="", well=None)
    off = replace(begun, checked_at=NOTED.checked_at, well=False, corrections=(0,) * 11, moved_mm=0)
    notes.note({"line3-a": NOTED, "line3-b": begun, "off": off}, {})
    with FleetStore(location, clock=wall) as store:
        plan = permitted(store, plan_with(3, rings=[1, 2]))
        carried_out(store, plan, cells_of(1)[0], JobOutcome(6, "OutcomeUnknownError"))
    wall.go_on(seconds=30)
    found = scraped(served)
    assert found["robolink_plant_up"] == 1
    assert found["robolink_agent_turn_timestamp_seconds"] == 1764540000.0
    assert found["robolink_unsettled", "line3-a"] == 0
    assert found["robolink_unsettled", "line3-b"] == 1
    assert found["robolink_check_age_seconds", "line3-a"] == 3630
    assert found["robolink_check_age_seconds", "line3-b"] == math.inf  # never: overdue by any rule
    assert found["robolink_check_age_seconds", "off"] == 3630
    assert found["robolink_check_well", "line3-a"] == 1
    assert found["robolink_check_well", "off"] == 0
    assert ("robolink_check_well", "line3-b") not in found.values
    assert found["robolink_note_age_seconds", "line3-b"] == 30
    assert found["robolink_changes_total", "done", "line3-a"] == 3
    assert found["robolink_changes_total", "line3-a", "refused"] == 1
    assert found["robolink_correction_mm_bucket", "0.02"] == 0
    assert found["robolink_correction_mm_bucket", "0.05"] == 2  # of two cells
    assert found["robolink_correction_mm_bucket", "10.0"] == 2
    assert found["robolink_correction_mm_bucket", "+Inf"] == 6
    assert found["robolink_correction_mm_sum"] == 82.06
    assert found["robolink_jobs", plan.id, "offset", "unsettled"] == 1
    assert found["robolink_jobs", plan.id, "offset", "waiting"] == 2
    assert found["robolink_plan_halted", plan.id, "unsettled"] == 1
    assert "robolink_outbox_entries" not in found.names or "://" in location


def test_labels_are_names_and_never_what_somebody_wrote(notes, served, location, wall):
    free = 'what a person typed: {}"\n'
    verdict = replace(NOTED, verdict=free)
    notes.note({"line3-a": verdict}, {})
    with FleetStore(location, clock=wall) as store:
        plan = permitted(store, plan_with(2, name="a name that a person typed"))
        store.halt(plan.id, "Li", "a reason that a person typed")
    text = scraped(served).text
    assert "typed" not in text
    assert "Li" not in text


def test_a_plan_that_was_resumed_or_cancelled_is_not_halted(served, location, wall):
    with FleetStore(location, clock=wall) as store:
        plan = permitted(store, plan_with(2))
        store.halt(plan.id, "Li")
        assert scraped(served)["robolink_plan_halted", plan.id, "person"] == 1
        store.resume(plan.id, "Li", "on")
        assert "robolink_plan_halted" not in scraped(served).names
        store.cancel(plan.id, "Li")
        assert "robolink_plan_halted" not in scraped(served).names


def test_only_reading_is_answered(served):
    for method in ("POST", "PUT", "DELETE"):
        with pytest.raises(HTTPError) as refused:
            urlopen(Request(served, method=method, data=b"x"), timeout=20)
        assert refused.value.code == 405
        refused.value.close()


def connections_of(url, count, sending=b""):
    address = ("127.0.0.1", int(url.rpartition(":")[2].partition("/")[0]))
    found = [socket.create_connection(address, timeout=20) for _ in range(count)]
    for one in found:
        one.sendall(sending)
    return found


def ended(one):
    """Whether the far end closes a connection, without an answer."""
    try:
        return one.recv(1) == b""
    except ConnectionResetError:
        return True


def test_silent_connections_are_few_and_keep_nobody_out_for_long(served, monkeypatch):
    monkeypatch.setattr(served_metrics._Handler, "timeout", 2.0)
    silent = connections_of(served, 40)
    first, further = silent[: served_metrics.MOST_AT_ONCE], silent[served_metrics.MOST_AT_ONCE :]
    assert all(map(ended, further))
    assert select.select(first, [], [], 0)[0] == [], "those who came first are not closed yet"
    assert all(map(ended, first))
    assert scraped(served)["robolink_plant_up"] == 1
    for one in silent:
        one.close()


def test_a_connection_that_sends_a_byte_now_and_then_ends_too(served, monkeypatch):
    monkeypatch.setattr(served_metrics._Handler, "timeout", 60.0)
    monkeypatch.setattr(served_metrics, "LONGEST_S", 0.1)
    slow = connections_of(served, served_metrics.MOST_AT_ONCE, b"G")
    assert all(map(ended, slow))
    assert scraped(served)["robolink_plant_up"] == 1
    for one in slow:
        one.close()


def test_a_database_that_hangs_is_told_within_a_limit_and_has_one_look(notes):
    let_go, looks = threading.Event(), []

    def look():
        looks.append(1)
        let_go.wait(60)
        return notes.look()

    metrics = PlantMetrics(look, lambda: 5.0, limit_s=0.05)
    with metrics_served("127.0.0.1", 0, metrics) as url:
        began = time.monotonic()
        for _ in range(3):
            found = scraped(url)
            assert (found["robolink_plant_up"], len(found.values)) == (0, 2)
        assert time.monotonic() - began < 15
        assert found["robolink_agent_turn_timestamp_seconds"] == 5.0
        assert len(looks) == 1
        let_go.set()
        until = time.monotonic() + 20
        while scraped(url)["robolink_plant_up"] == 0 and time.monotonic() < until:
            time.sleep(0.01)
        assert scraped(url)["robolink_plant_up"] == 1


def test_a_database_that_is_away_is_told_and_comes_back(served, notes, location, server_of):
    notes.note({"line3-a": NOTED}, {})
    assert scraped(served)["robolink_plant_up"] == 1
    with server_of(location):
        assert scraped(served)["robolink_plant_up"] == 0
    assert scraped(served)["robolink_unsettled", "line3-a"] == 0


def test_a_port_that_is_taken_is_refused_by_name(served, notes):
    port = int(served.rpartition(":")[2].partition("/")[0])
    metrics = PlantMetrics(notes.look, lambda: 0.0)
    with (
        pytest.raises(ConfigError, match=f"127.0.0.1:{port}"),
        metrics_served("127.0.0.1", port, metrics),
    ):
        pass


@pytest.mark.skipif(not shutil.which("promtool"), reason="promtool (Debian: prometheus) is missing")
def test_promtool_finds_nothing_to_say(notes, served, location, wall):
    notes.note({"line3-a": NOTED}, {})
    with FleetStore(location, clock=wall) as store:
        store.halt(permitted(store, plan_with(2)).id, "Li")
    text = scraped(served).text.encode()
    command = ["promtool", "check", "metrics"]
    judged = subprocess.run(command, check=False, input=text, capture_output=True)
    assert (judged.returncode, judged.stderr.decode()) == (0, "")


def test_the_page_names_every_metric_and_its_rules_only_those(notes, served, location, wall):
    notes.note({"line3-a": NOTED}, {})
    with FleetStore(location, clock=wall) as store:
        store.halt(permitted(store, plan_with(2)).id, "Li")
    page = (Path(__file__).parents[2] / "docs" / "fleet.md").read_text(encoding="utf-8")
    section = page.partition("### Metrics")[2].partition("### Messages")[0]
    table, _, rules = section.partition("```yaml")
    named = set(re.findall(r"`(robolink_\w+)`", table))
    kinds = ("_bucket", "_count", "_sum")
    found = scraped(served).names
    there = {re.sub(f"({'|'.join(kinds)})$", "", name) for name in found}
    assert there | {"robolink_outbox_entries"} == named
    assert set(re.findall(r"robolink_\w+", rules)) <= named
