"""Each promise of docs/reference/rules.md has its place, and a check that fails without it."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from robolink.testing import (
    MOVING_CHECKS,
    READING_CHECKS,
    WRITING_CHECKS,
    WRITING_WHILE_MOVING_CHECKS,
    outcomes,
)
from tests.contract import test_controller_contract
from tests.contract._kinds import IMMOBILE, KINDS
from tests.contract._without_guards import LEFT, found, without

PAGE = Path("docs/reference/rules.md").read_text(encoding="utf-8")
CHECKS = {
    check.__name__: check
    for check in (
        *READING_CHECKS,
        *WRITING_CHECKS,
        *MOVING_CHECKS,
        *WRITING_WHILE_MOVING_CHECKS,
    )
}
MOVING = {check.__name__ for check in (*MOVING_CHECKS, *WRITING_WHILE_MOVING_CHECKS)}


def table():
    """Yield each row: its rule, its promise, its places and its checks."""
    listed = PAGE.partition("## Where each is kept")[2]
    for line in re.findall(r"^\| \d+ \|.*$", listed, re.MULTILINE):
        rule, promise, places, tries = (cell.strip() for cell in line.strip("|").split("|"))
        yield int(rule), promise, re.findall(r"`([^`]+)`", places), re.findall(r"`([^`]+)`", tries)


ROWS = list(table())
EACH = [
    (promise, place, tried)
    for _, promise, places, tries in ROWS
    for place in places
    for tried in tries
]

PLUGIN = "tests.contract._without_guards"
UNTRIED = {"robolink.files.durable.sync_folder"}
"""A place that a platform lacks cannot be removed; its own test hides it from all of robolink."""

OWN = {"robolink.controllers.ToolTableCore.same": "epson"}
"""Kinds that implement a place themselves; others are tried on the in-memory controller."""


def test_every_rule_stands_in_the_table():
    rules = {int(number) for number in re.findall(r"^## (\d+)\. ", PAGE, re.MULTILINE)}
    assert {rule for rule, *_ in ROWS} == rules
    assert all(places and tries for _, _, places, tries in ROWS)


@pytest.mark.parametrize(("promise", "place", "tried"), EACH)
def test_each_place_and_what_tries_it_are_there(promise, place, tried):
    found(place)
    assert (place in LEFT) != (place in UNTRIED), f"{place} is never taken out"
    if "::" in tried:
        path, _, name = tried.partition("::")
        assert re.search(rf"^def {name}\(", Path(path).read_text("utf-8"), re.MULTILINE), tried
        return
    # A promise missing from the tuples that the kinds run would never be checked.
    checks_of = test_controller_contract.checks_of
    run_on = {kind for kind in KINDS if tried in {it.__name__ for it in checks_of(kind)}}
    assert run_on == set(KINDS) - (set(IMMOBILE) if tried in MOVING else set()), tried


@pytest.mark.parametrize("place", sorted(LEFT))
def test_what_is_taken_out_is_there(place):
    for imported in LEFT[place]:
        found(imported)


def test_nothing_is_taken_out_that_the_page_does_not_name():
    assert set(LEFT) == {place for _, _, places, _ in ROWS for place in places} - UNTRIED


@pytest.mark.parametrize(
    ("place", "tried"),
    sorted(
        {(place, tried) for _, place, tried in EACH if "::" not in tried and place not in UNTRIED}
    ),
)
def test_a_check_fails_where_its_guard_is_taken_out(place, tried):
    with KINDS[OWN.get(place, "memory")]() as kind:
        with without(place):
            (broken,) = outcomes(kind.subject, [CHECKS[tried]])
        with kind.opened(None) as controller:
            for marker in controller.outcomes.open_markers():
                controller.finish(marker)
        assert broken.broken, f"{tried} does not look at {place}"
        (kept,) = outcomes(kind.subject, [CHECKS[tried]])
        assert not kept.broken


BY_TESTS = [
    pytest.param(place, tried, id=f"{place.rpartition('.')[2]}-{tried.rpartition('::')[2]}")
    for _, place, tried in EACH
    if "::" in tried and place not in UNTRIED
]


@pytest.mark.soak
@pytest.mark.timeout(300)
@pytest.mark.parametrize(("place", "tried"), BY_TESTS)
def test_a_test_fails_where_its_guard_is_taken_out(place, tried):
    """The test runs in a process of its own, before anything has imported the guard."""
    line = [sys.executable, "-m", "pytest", "-n", "0", "-q", "-x", "-p", PLUGIN, tried]
    environment = {**os.environ, "ROBOLINK_WITHOUT": place}
    done = subprocess.run(line, env=environment, capture_output=True, text=True, check=False)
    assert "1 failed" in done.stdout, done.stdout[-2000:]
