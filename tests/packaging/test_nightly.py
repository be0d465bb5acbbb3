"""``make nightly``: every part is run, bounded, and told as it ended."""

import importlib.util
import re
import sys
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
_SPEC = importlib.util.spec_from_file_location("nightly", ROOT / "tools/nightly.py")
assert _SPEC is not None
nightly = importlib.util.module_from_spec(_SPEC)
sys.modules["nightly"] = nightly  # a dataclass looks for its module there
assert _SPEC.loader is not None
_SPEC.loader.exec_module(nightly)

HELD = "seed 7 epson: 20 h, 9 events, ab every rule held\n"


def outcome(script, tmp_path, *, share=1.0, night_h=1.0, endless=False):
    part = nightly.Part("a part", share, ("sh", "-c", script), endless)
    return nightly.carry_out(part, night_h, tmp_path, tmp_path)


@pytest.mark.parametrize(
    ("script", "how", "lacks"),
    [
        ("echo fine", "passed", ()),
        ("exit 3", "FAILED", ()),
        ("echo Not all judges are here. Install them.; exit 2", "not run", 1),
        ("echo 'newest-3.14          NOT RUN  no Python 3.14'; exit 1", "not run", 1),
        ("echo 'a  NOT RUN  no x'; echo 'b  FAILED'; exit 1", "FAILED", 1),
        ("echo 'SKIPPED [2] tests/peers/judge_x.py:9: no iec2c'", "passed", ("no iec2c",)),
    ],
)
def test_a_part_is_told_as_it_ended(tmp_path, script, how, lacks):
    found = outcome(script, tmp_path)
    assert found.how == how
    assert len(found.lacks) == lacks if isinstance(lacks, int) else found.lacks == lacks
    assert (tmp_path / "a-part.log").exists()


@pytest.mark.parametrize(
    ("endless", "printed", "how"),
    [
        (False, HELD, "FAILED"),
        (True, HELD, "passed"),
        (True, HELD.replace("every rule held", "moves once: twice") + HELD, "FAILED"),
        (True, "nothing yet\n", "FAILED"),
    ],
)
def test_what_is_stopped_at_its_share_counts_by_what_it_has_shown(endless, printed, how):
    part = nightly.Part("a part", 1, (), endless)
    assert nightly.judged(part, None, printed, 1.0).how == how


def test_a_part_is_ended_at_its_share_with_all_that_it_started(tmp_path):
    found = outcome("sleep 600 & echo $! > child; wait", tmp_path, night_h=2 / 3600)
    assert (found.how, "share" in found.said) == ("FAILED", True)
    child = Path("/proc") / (tmp_path / "child").read_text().strip() / "stat"
    for _ in range(100):
        if not child.exists() or child.read_text().split()[2] == "Z":
            return
        time.sleep(0.1)
    pytest.fail("it goes on")


def test_a_command_that_is_missing_is_not_run(tmp_path):
    part = nightly.Part("a part", 1, ("no-such-program-of-anybody",))
    assert nightly.carry_out(part, 1, tmp_path, tmp_path).how == "not run"


def test_the_table_counts_what_was_not_run_apart():
    outcomes = [
        nightly.Outcome("docs", "passed", 1.25),
        nightly.Outcome("peers", "not run", 0, lacks=("no mbpoll",)),
        nightly.Outcome("faults", "FAILED", 2, "ended with 2"),
    ]
    text = "\n".join(nightly.table(outcomes, "commit abc, 2026-11-28"))
    assert "commit abc, 2026-11-28" in text
    assert "| docs | passed | 1.2 |" in text
    assert "1 passed, 1 FAILED, 1 not run." in text
    assert "* not run: peers: no mbpoll" in text


def test_a_night_can_be_made_in_pieces(tmp_path):
    kept = tmp_path / "outcomes.json"
    faults, docs = (nightly.Outcome(name, "FAILED", 2, lacks=("x",)) for name in ("faults", "docs"))
    assert nightly.with_those_of_before([faults], "commit a", kept) == [faults]
    assert nightly.with_those_of_before([docs], "commit a", kept) == [docs, faults]
    mended = nightly.Outcome("docs", "passed", 1)
    assert nightly.with_those_of_before([mended], "commit a", kept) == [mended, faults]
    assert nightly.with_those_of_before([mended], "commit b", kept) == [mended]


def test_the_shares_are_one_night_and_each_target_exists():
    assert sum(part.share for part in nightly.PARTS) == pytest.approx(1)
    targets = set(re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    words = {word for part in nightly.PARTS if part.command[0] == "make" for word in part.command}
    assert words - targets == {"make", "-o", "SEEDS=fresh", "MARKS=soak and not fault"}
    with pytest.raises(SystemExit, match="There is no part tea"):
        nightly.chosen(["tea"])
    assert [part.name for part in nightly.chosen(["fresh-seeds"])] == ["fresh seeds"]
