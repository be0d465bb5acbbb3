"""The adversary's seeds, rules and books, without its hours."""

import sqlite3
import subprocess
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest
from robolink_simulators.cell.clock import ManualClock
from robolink_simulators.cell.frames import Frame

from robolink.errors import ConfigError
from robolink.model import ToolOffset, plain_offset
from tests.soak.adversary import __main__ as adversary
from tests.soak.adversary import drawn_history
from tests.soak.adversary.__main__ import FRESH, _noted
from tests.soak.adversary.books import BookedMarker, Books
from tests.soak.adversary.cell import VirtualCell
from tests.soak.adversary.people import wish_of
from tests.soak.adversary.plant.epson import EpsonPlant
from tests.soak.adversary.plant.machine import USUAL_TOOL, SentKind, SentRequest
from tests.soak.adversary.rules import Rulebook
from tests.soak.adversary.seed_records import (
    LOWEST,
    ListedRange,
    SeedList,
    committed,
    source_digest,
)

# Rules of the adversary that no known defect breaks: each reports when it is broken.

WRITE = SentRequest(SentKind.WRITE, '$Execute,"TLSet 2, XY(1, 2, 3, 0)"', 2)
MOVE = SentRequest(SentKind.MOVE, '$Execute,"Move XY(1, 2, 3, 0)"')


class OpenMarker:
    """A journal that holds one marker of a write of tool 2."""

    trusted, lost = True, False

    def __init__(self, requested):
        details = {"tool": 2, "before": None, "requested": plain_offset(requested)}
        self.marker = BookedMarker("one", "set", "TLSet 2", details)

    def markers(self):
        """Return the marker."""
        return [self.marker]

    def holder(self):
        """Return the holder of the lease."""
        return {"pid": 101}

    def last_number(self):
        """Return the number of the newest entry."""
        return 0


@pytest.fixture
def begun():
    """Begin an hour with a line; return its rules, its machine and its broken rules."""

    def begin(line=(), *, requested=USUAL_TOOL):
        history = drawn_history(23, hours=2)
        hour = replace(history.hours[1], line=tuple(line))
        cell = VirtualCell(history, Path("disk"))
        plant = EpsonPlant(ManualClock(), cell, seed=23)
        rules = Rulebook(cell.story, plant, cast(Any, OpenMarker(requested)))
        rules.begin(hour, wish_of(hour))
        return rules, plant, lambda: [one.rule for one in cell.story.broken]

    return begin


@pytest.fixture
def process():
    return cast(
        Any,
        SimpleNamespace(number=101, held_back=False, stopped_ns=None, put_back=set(), alive=True),
    )


def controller(*, closed):
    return cast(Any, SimpleNamespace(latch=SimpleNamespace(closed=closed)))


@pytest.mark.parametrize(("line", "broken"), [(("--dry-run",), ["ContractHolds"]), ((), [])])
def test_a_dry_run_sends_nothing_that_writes(begun, process, line, broken):
    rules, _, found = begun(("tool", "set", "2", *line))
    rules.contract.leaving(process, WRITE)
    assert found() == broken
    rules.contract.left()
    rules.contract.leaving(process, WRITE)  # the people recover something
    assert found() == broken


@pytest.mark.parametrize(
    ("requested", "broken"), [(USUAL_TOOL, ["ContractHolds"]), (ToolOffset(1.0, 2.0, 3.0), [])]
)
def test_what_is_there_already_is_not_written_again(begun, process, requested, broken):
    rules, _, found = begun(requested=requested)
    rules.leaving(process, WRITE)
    assert found() == broken


def test_from_the_first_instant_of_a_stop_no_movement_leaves(begun, process):
    rules, _, found = begun()
    rules.contract.stopping(process)
    rules.contract.stops.leaving(process, WRITE)
    assert found() == []
    rules.contract.stops.leaving(process, MOVE)
    assert found() == ["StillAfterStop"]


def test_only_a_release_opens_the_latch(begun, process):
    rules, _, found = begun()
    rules.contract.stopping(process)
    rules.contract.has_stopped(process, controller(closed=True), acknowledged=True)
    rules.contract.has_reset(process, controller(closed=True))
    rules.contract.releasing(process)
    rules.contract.has_reset(process, controller(closed=False))
    assert found() == []
    rules.contract.stopping(process)
    rules.contract.has_reset(process, controller(closed=False))
    assert found() == ["StillAfterStop"]


def test_what_was_acknowledged_as_stopped_stands_until_something_is_sent(
    begun, process, monkeypatch
):
    rules, plant, found = begun()
    rules.stopped()
    rules.contract.passed()
    assert found() == []
    off = Frame((1.0, 0.0, 0.0)) @ plant.flange()
    monkeypatch.setattr(plant, "flange", lambda: off)
    rules.contract.stops.leaving(process, MOVE)
    rules.contract.passed()
    assert found() == []
    monkeypatch.undo()
    rules.stopped()
    monkeypatch.setattr(plant, "flange", lambda: off)
    rules.contract.passed()
    assert found() == ["AtRestWhenStopped"]


# Fresh seeds: drawn from the commit, apart from all seeds ever run.

COMMIT = "0123456789abcdef0123456789abcdef01234567"


@pytest.fixture
def seeds(tmp_path):
    path = tmp_path / "seeds_run.txt"
    path.write_text("# what was run\n0-499 many\n7000-7199 44741d42\n7300 44741d42 abc\n")
    return SeedList(path)


def test_a_list_is_read(seeds):
    found = seeds.ranges()
    assert [(one.seeds.start, one.seeds.stop) for one in found] == [
        (0, 500),
        (7000, 7200),
        (7300, 7301),
    ]
    assert found[2] == ListedRange(range(7300, 7301), "44741d42", "abc")


def test_a_commit_draws_the_same_range_each_time_and_another_one_another(seeds):
    drawn = seeds.drawn(COMMIT, 1000)
    assert drawn == seeds.drawn(COMMIT, 1000)
    assert len(drawn) == 1000
    assert drawn.start >= LOWEST
    assert drawn != seeds.drawn(COMMIT[::-1], 1000)


def test_what_was_run_is_never_drawn_again(seeds):
    first = seeds.drawn(COMMIT, 1000)
    seeds.note(range(first.stop - 1, first.stop + 5), "other", "")
    second = seeds.drawn(COMMIT, 1000)
    assert not set(first) & set(second)
    seeds.note(second, COMMIT, "abc")
    assert not set(seeds.drawn(COMMIT, 1000)) & set(second)


def test_a_range_is_noted_once(seeds):
    seeds.note(range(7010, 7020), "named", "abc")
    assert len(seeds.ranges()) == 3
    seeds.note(range(490, 510), "named", "abc")
    assert str(seeds.ranges()[-1]) == "490-509 named abc"


def test_a_fresh_range_is_gone_on_with_until_it_is_run(seeds, monkeypatch):
    monkeypatch.setattr(adversary, "committed", lambda _folder: COMMIT)
    sources = source_digest()
    begun = range(LOWEST, LOWEST + 10)
    seeds.note(begun, COMMIT, sources)
    assert seeds.of_sources(sources) == begun
    assert seeds.of_sources("others") is None
    assert _noted(seeds, FRESH, 10, set(begun[:4])) == begun
    following = _noted(seeds, FRESH, 10, set(begun))
    assert not set(following) & set(begun)
    assert seeds.of_sources(sources) == following


def test_seeds_that_are_named_are_noted_too(seeds):
    assert _noted(seeds, range(8000, 8003), 10, set()) == range(8000, 8003)
    assert str(seeds.ranges()[-1]).startswith("8000-8002 named ")


def test_only_a_commit_draws(tmp_path):
    with pytest.raises(ConfigError, match="drawn from a commit"):
        committed(tmp_path)


def test_sources_that_differ_from_the_commit_draw_nothing(tmp_path):
    def git(*arguments):
        who = ("-c", "user.name=a", "-c", "user.email=a@b.invalid")
        subprocess.run(("git", *who, *arguments), cwd=tmp_path, check=True, capture_output=True)

    (tmp_path / "robolink").mkdir()
    (tmp_path / "robolink" / "a.py").write_text("1\n")
    git("init", "-q")
    git("add", ".")
    git("commit", "-q", "-m", "a")
    assert len(committed(tmp_path)) == 40
    (tmp_path / "seeds_run.txt").write_text("0-9 a\n")
    assert len(committed(tmp_path)) == 40
    (tmp_path / "robolink" / "a.py").write_text("2\n")
    with pytest.raises(ConfigError, match="Commit the changes first"):
        committed(tmp_path)
    git("commit", "-q", "-a", "-m", "b")
    (tmp_path / "tests" / "soak" / "adversary").mkdir(parents=True)
    (tmp_path / "tests" / "soak" / "adversary" / "rule.py").write_text("3\n")
    with pytest.raises(ConfigError, match="Commit the changes first"):
        committed(tmp_path)


# The adversary's readings of a journal whose file has lost pages.


@pytest.fixture
def books(tmp_path):
    path = tmp_path / "journal.db"
    with closing(sqlite3.connect(path)) as file, file:
        file.execute("CREATE TABLE markers (id, operation, kind, request, details)")
        file.execute("CREATE TABLE leases (token, holder)")
        file.execute("CREATE TABLE entries (number, proved_tool, details)")
        file.execute("INSERT INTO markers VALUES (NULL, NULL, NULL, NULL, NULL)")
        file.execute("INSERT INTO leases VALUES (1, '{\"pid\":')")
        file.execute("INSERT INTO entries VALUES (1, 2, NULL)")
    found = Books(path)
    yield found
    found.close()


@pytest.mark.parametrize(
    ("look", "nothing"),
    [
        (lambda books: books.markers(), []),
        (lambda books: books.holder(), None),
        (lambda books: books.value_of(2), (False, None)),
    ],
)
def test_rows_of_which_half_is_lost_are_damage_and_no_defect(books, look, nothing):
    assert look(books) == nothing
    assert not books.trusted
