"""``python -m tests.soak.adversary``: run seeds, replay one, shrink one, make a test of it."""

import sys
import time
from collections.abc import Collection
from pathlib import Path
from typing import Final

import click

from robolink.errors import ConfigError
from robolink.timing import wall_label
from tests.soak.adversary.drawn_hours import drawn_history
from tests.soak.adversary.history import CellKind, History
from tests.soak.adversary.history_run import as_test, live_through, shrink
from tests.soak.adversary.seed_records import (
    ResultsFile,
    SeedList,
    SeedResult,
    committed,
    source_digest,
    summed_up,
)

FRESH: Final = range(0)
"""The placeholder for seeds that are drawn from the commit."""


class SeedRange(click.ParamType[range]):
    """``A-B``, both included, one number, or ``fresh``."""

    name = "seeds"

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> range:
        """Return the seeds."""
        if value == "fresh":
            return FRESH
        first, dash, last = str(value).partition("-")
        if not (first.isdigit() and (last.isdigit() or not dash)):
            self.fail(f"{value!r} is not like 0-499, and not fresh", param, ctx)
        return range(int(first), int(last or first) + 1)


class Share(click.ParamType[slice]):
    """``1/2``: the first of two parts that run side by side."""

    name = "share"

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> slice:
        """Return the seeds of a range that belong to the part."""
        part, _, parts = str(value).partition("/")
        if not (part.isdigit() and parts.isdigit() and 0 < int(part) <= int(parts)):
            self.fail(f"{value!r} is not like 1/2", param, ctx)
        return slice(int(part) - 1, None, int(parts))


@click.command()
@click.option(
    "--seeds",
    type=SeedRange(),
    help="Run these: 0-499, or fresh, which are drawn from the commit. Those that were run are "
    "skipped.",
)
@click.option(
    "--count", type=click.IntRange(1), default=1000, show_default=True, help="How many fresh seeds."
)
@click.option(
    "--share", type=Share(), default="1/1", help="Which part of the seeds: 2/2 is every second one."
)
@click.option("--seed", type=int, help="This one, for --replay, --shrink and --write-test.")
@click.option("--hours", type=click.IntRange(1), default=20, show_default=True, help="A seed.")
@click.option("--kind", type=click.Choice([kind.value for kind in CellKind]), help="Of the cell.")
@click.option("--replay", is_flag=True, help="Tell the whole story, event by event.")
@click.option("--shrink", "shrinks", is_flag=True, help="Leave out all that is not needed.")
@click.option("--write-test", type=click.Path(path_type=Path), help="Write the test of it there.")
@click.option(
    "--results",
    type=click.Path(path_type=Path),
    default=Path("build/soak/results.jsonl"),
    show_default=True,
    help="Where a line for each seed is kept.",
)
@click.option(
    "--list",
    "listed",
    type=click.Path(path_type=Path),
    default=Path("tests/soak/seeds_run.txt"),
    show_default=True,
    help="Where the list of all seeds ever run is kept.",
)
def main(
    seeds: range | None,
    count: int,
    share: slice,
    seed: int | None,
    hours: int,
    kind: str | None,
    replay: bool,
    shrinks: bool,
    write_test: Path | None,
    results: Path,
    listed: Path,
) -> None:
    """Run whole simulated cells against seeded disturbances, and check the rules all the time."""
    own = None if kind is None else CellKind(kind)
    if seed is not None:
        sys.exit(_one(drawn_history(seed, hours, own), replay, shrinks, write_test))
    if seeds is None:
        click.echo("\n".join(summed_up(ResultsFile(results).results())) or "nothing was run yet")
        return
    file = ResultsFile(results)
    try:
        chosen = _noted(SeedList(listed), seeds, count, file.done(hours))
    except ConfigError as error:
        raise click.ClickException(str(error)) from error
    sys.exit(_range(chosen[share], hours, own, file))


def _noted(known: SeedList, seeds: range, count: int, done: Collection[int]) -> range:
    """Return the seeds to run, once they are on the list.

    A fresh range that was not completed on the same sources is continued.
    """
    sources = source_digest()
    if seeds is not FRESH:
        known.note(seeds, "named", sources)
        return seeds
    commit = committed(Path.cwd())
    begun = known.of_sources(sources)
    fresh = begun if begun is not None and set(begun) - set(done) else known.drawn(commit, count)
    known.note(fresh, commit[:12], sources)
    click.echo(f"fresh seeds {fresh.start}-{fresh.stop - 1}, sources {sources}")
    return fresh


def _one(history: History, replay: bool, shrinks: bool, write_test: Path | None) -> int:
    story = live_through(history)
    if story.broken and (shrinks or write_test):
        rule = story.broken[0].rule
        story = live_through(shrink(history, rule))
        if write_test is not None:
            write_test.write_text(as_test(story.history, rule), encoding="utf-8")
    told = story.told()
    if replay and not story.broken:
        told = "\n".join((told, *story.lines()))
    click.echo(told)
    return 1 if story.broken else 0


def _range(seeds: range, hours: int, kind: CellKind | None, results: ResultsFile) -> int:
    done, failed = results.done(hours), False
    for seed in seeds:
        if seed in done:
            continue
        begun_s = time.process_time()
        story = live_through(drawn_history(seed, hours, kind))
        result = SeedResult.of(story, ended_at=wall_label(), cpu_s=time.process_time() - begun_s)
        results.add(result)
        failed |= bool(story.broken)
        click.echo(
            f"seed {seed} {story.history.kind}: {story.hours} h, {story.events} events, "
            f"{story.hash[:16]} " + ("; ".join(result.broken) or "every rule held")
        )
    click.echo("\n".join(summed_up(results.results())))
    return 1 if failed else 0


if __name__ == "__main__":
    main()
