"""A process that serves collects garbage so that what has survived once is hardly ever seen."""

import gc
import json
import subprocess
import sys

import pytest
from robolink_cli import main
from robolink_simulators.epson import EpsonSimulator
from robolink_simulators.hosting.streams.epson import serve_tcp

import robolink

COLLECTED = """
import gc
from weakref import ref

from robolink_simulators.hosting.garbage import RareFullCollections


class Ring:
    def __init__(self):
        self.itself = self


gc.disable()
before = list(gc.callbacks)
with RareFullCollections(spare=0) as collections:
    at_first = gc.get_freeze_count()
    rings = [Ring() for _ in range(500)]
    seen = [ref(ring) for ring in rings]
    gc.collect(0)
    assert gc.get_freeze_count() == at_first, "one of the youngest alone sets nothing aside"
    gc.collect(1)
    assert gc.get_freeze_count() >= at_first + 500, "what survives is set aside"
    rings.clear()
    gc.collect()
    assert sum(ring() is not None for ring in seen) == 500, "and not looked at"
    more = [[] for _ in range(2 * at_first)]
    del more
    gc.collect(1)
    assert collections.thaws == 0, "what has gone by itself does not count"
    more = [[] for _ in range(at_first)]
    gc.collect(1)
    assert (collections.thaws, gc.get_freeze_count()) == (1, 0), "until it is twice what it was"
    gc.collect(1)
    assert gc.get_freeze_count() == 0, "then nothing is set aside"
    gc.collect()
    assert sum(ring() is not None for ring in seen) == 0, "before its garbage is found"
    in_use = gc.get_freeze_count()
    assert in_use >= 2 * at_first
    more += [[] for _ in range(in_use // 2)]
    gc.collect(1)
    gc.collect()
    assert collections.thaws == 1, "and what was found in use is what counts from then on"
assert (gc.get_freeze_count(), gc.callbacks) == (0, before), "at the end all is as it was"

gc.freeze()
count = gc.get_freeze_count()
with RareFullCollections():
    assert (gc.get_freeze_count(), gc.callbacks) == (count, before), "somebody else has decided"
assert gc.get_freeze_count() == count
"""


def collector():
    """What is set; of what is set aside some may go by itself."""
    return list(gc.callbacks), gc.get_threshold(), gc.isenabled()


@pytest.fixture
def nothing_set_aside():
    """As in a process that nobody has told anything; this one has."""
    enabled = gc.isenabled()
    gc.disable()
    gc.unfreeze()
    yield
    gc.freeze()
    if enabled:
        gc.enable()


def test_what_survives_is_set_aside_and_looked_at_again_once_it_has_doubled():
    # In a process of its own: this one holds all the tests.
    subprocess.run([sys.executable, "-c", COLLECTED], check=True, timeout=60)


def test_a_cell_inside_of_a_program_leaves_its_collector_alone(nothing_set_aside):
    before = collector()
    with serve_tcp(EpsonSimulator()) as host, robolink.connect(host.url) as other:
        other.status()
        assert collector() == before
        assert gc.get_freeze_count() == 0
    with robolink.connect("epson+sim://collector?seed=1") as controller:
        controller.status()
        assert collector() == before
        assert gc.get_freeze_count() == 0


@pytest.mark.parametrize("of_a_file", [False, True])
def test_commands_that_serve_set_aside_while_they_serve(
    of_a_file, nothing_set_aside, monkeypatch, tmp_path
):
    """The first line is printed once all is served."""
    looks = []

    class Looking:
        encoding, errors = "utf-8", "strict"

        def write(self, text):
            looks.append((text, gc.get_freeze_count()))
            return len(text)

        def flush(self):
            pass

        def isatty(self):
            return False

    monkeypatch.setattr(sys, "stdout", Looking())
    cells = tmp_path / "cells.toml"
    cells.write_text(
        'schema = "robolink/sim-cells/1"\n[cells.one]\nkind = "epson"\ntcp = "127.0.0.1:0"\n',
        encoding="utf-8",
    )
    what = ["run", str(cells)] if of_a_file else ["epson", "--tcp", "127.0.0.1:0"]
    assert main.run(["sim", *what, "--idle-exit", "0.1", "--json"]) == 0
    first, set_aside = next((text, count) for text, count in looks if text)
    assert json.loads(first)["simulated"]
    assert set_aside > 1000
    assert gc.get_freeze_count() == 0
