"""Fresh seeds: drawn from the commit, beside everything that was ever run."""

import subprocess

import pytest

from robolink.errors import ConfigError
from tests.soak.adversary import __main__ as adversary
from tests.soak.adversary.__main__ import FRESH, _noted
from tests.soak.adversary.seed_records import (
    LOWEST,
    ListedRange,
    SeedList,
    committed,
    source_digest,
)

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
