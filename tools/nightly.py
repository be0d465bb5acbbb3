"""``make nightly``: run all that ``make test`` leaves out, and print one table of how it ended.

What no commit runs rots unseen. Each part is a command of its own, has a share of the night, and
is run whatever became of the others. What a machine lacks is *not run* and counted apart: it is no
failure, and no pass either. The table is kept in ``build/nightly/table.md`` with commit and date,
and what a part printed beside it. Ends with 1 when a part failed.

NIGHT says how many hours there are; parts that are named are run alone. The table has the last
outcome of each part on the commit, so a night can be made in pieces.
"""

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).parents[1]
FOLDER: Final = ROOT / "build" / "nightly"

_LACKS: Final = re.compile(
    r"^(Not all judges are here.*|Windows was not tried: .*|\S+ +NOT RUN .*)$", re.MULTILINE
)
"""Lines in which a part reports that this machine lacks something."""

_SKIPPED: Final = re.compile(r"^SKIPPED \[\d+\] [^:]+:(?:\d+:)? (.*)$", re.MULTILINE)
_FAILED: Final = re.compile(r"\bFAILED\b")
_SEED: Final = re.compile(r"^seed \d+ .* events, ", re.MULTILINE)
_BROKEN: Final = re.compile(r"^seed \d+ (?!.*every rule held$).* events, ", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class Part:
    """Something to run.

    Attributes:
        name: What it is called.
        share: Of the night, 0 to 1: longer it may not take.
        command: What is run; ``{minutes}`` stands for nine tenths of its share.
        endless: Whether it is stopped at its share, and what it has shown until then counts.
    """

    name: str
    share: float
    command: tuple[str, ...]
    endless: bool = False


PARTS: Final = (
    Part("docs", 0.03, ("make", "docs")),
    # Killing an order at each of 866 instants (F79) takes more than half an hour.
    Part("faults", 0.16, ("make", "faults")),
    Part("peers", 0.05, ("make", "peers")),
    Part("windows", 0.08, ("make", "windows")),
    Part("versions", 0.13, ("make", "versions")),
    # The pages are a separate part: otherwise, broken pages would stop the rest of soak.
    # So are the faults, so that their long tests do not run twice a night.
    Part("soak", 0.2, ("make", "-o", "docs", "soak", "MARKS=soak and not fault")),
    Part("fresh seeds", 0.15, ("make", "soak", "SEEDS=fresh"), endless=True),
    Part("mutants", 0.2, (".venv/bin/python", "-m", "tests.mutants", "--minutes", "{minutes}")),
)
"""Parts of a night. The quick ones come first, so that after an hour most have ended."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """How a part ended.

    Attributes:
        name: The part.
        how: ``passed``, ``FAILED`` or ``not run``.
        minutes: What it took.
        said: What else there is to say, in a few words.
        lacks: What was not run, each with its reason.
    """

    name: str
    how: str
    minutes: float
    said: str = ""
    lacks: tuple[str, ...] = ()


def carry_out(part: Part, night_h: float, folder: Path = FOLDER, root: Path = ROOT) -> Outcome:
    """Run a part to its end, or to the end of its share; what it prints goes into its log."""
    limit_s = part.share * night_h * 3600
    command = [word.format(minutes=round(limit_s / 60 * 0.9, 1)) for word in part.command]
    log, begun_s = folder / f"{part.name.replace(' ', '-')}.log", time.monotonic()
    code: int | None = None
    with log.open("wb") as written:
        try:
            running = subprocess.Popen(
                command, cwd=root, stdout=written, stderr=subprocess.STDOUT, start_new_session=True
            )
        except OSError as error:
            return Outcome(part.name, "not run", 0, lacks=(f"{command[0]}: {error.strerror}",))
        try:
            code = running.wait(limit_s)
        except subprocess.TimeoutExpired:
            pass
        finally:
            _end(running)
    minutes = (time.monotonic() - begun_s) / 60
    return judged(part, code, log.read_text(encoding="utf-8", errors="replace"), minutes)


def _end(running: subprocess.Popen[bytes]) -> None:
    """End a part with all that it started: its processes are a group of their own."""
    with suppress(ProcessLookupError, subprocess.TimeoutExpired):
        os.killpg(running.pid, signal.SIGINT)
        running.wait(30)
    with suppress(ProcessLookupError):
        os.killpg(running.pid, signal.SIGKILL)
    running.wait()


def judged(part: Part, code: int | None, text: str, minutes: float) -> Outcome:
    """Return how a part ended.

    Args:
        part: The part.
        code: Its exit code; ``None`` where its share was over before it was.
        text: What it printed.
        minutes: What it took.
    """
    lacks = (*_LACKS.findall(text), *_SKIPPED.findall(text))
    lacks = tuple(dict.fromkeys(" ".join(lack.split()) for lack in lacks))
    seeds = len(_SEED.findall(text))
    said = f"{seeds} seeds" if seeds else ""
    if code == 0:
        return Outcome(part.name, "passed", minutes, said, lacks)
    if code is None and part.endless and seeds and not _BROKEN.search(text):
        return Outcome(part.name, "passed", minutes, f"{said}, then its share was over", lacks)
    if code is None:
        return Outcome(part.name, "FAILED", minutes, "its share was over before it ended", lacks)
    if _LACKS.search(text) and not _FAILED.search(text):
        return Outcome(part.name, "not run", minutes, said, lacks)
    return Outcome(part.name, "FAILED", minutes, f"ended with {code}", lacks)


def table(outcomes: Sequence[Outcome], heading: str) -> Iterator[str]:
    """Yield the lines of the table, and below it what was not run."""
    yield from (f"# Nightly run: {heading}", "", "| part | how it ended | minutes | |")
    yield "|---|---|---|---|"
    for one in outcomes:
        yield f"| {one.name} | {one.how} | {one.minutes:.1f} | {one.said} |"
    counted = [f"{sum(it.how == how for it in outcomes)} {how}" for how in _HOW]
    yield from ("", ", ".join(counted) + ".")
    if lacks := [f"* not run: {one.name}: {lack}" for one in outcomes for lack in one.lacks]:
        yield from ("", *lacks)


_HOW: Final = ("passed", "FAILED", "not run")


def _commit() -> str:
    def asked(*words: str) -> str:
        done = subprocess.run(
            ("git", *words), cwd=ROOT, capture_output=True, text=True, check=False
        )
        return done.stdout.strip()

    # Lists of seeds and versions that were run are records: a night adds to them.
    records = (":!tests/soak/seeds_run.txt", ":!tests/versions/tried.json")
    seen = ("--untracked-files=no", "--", ".", *records)
    changed = " with changes" if asked("status", "--porcelain", *seen) else ""
    return f"commit {asked('rev-parse', '--short=12', 'HEAD') or 'unknown'}{changed}"


def with_those_of_before(outcomes: Iterable[Outcome], commit: str, kept: Path) -> Sequence[Outcome]:
    """Return the last outcome of every part on a commit, in the order of a night, and keep them.

    Args:
        outcomes: Of the parts that ended just now.
        commit: What they ran on. Outcomes of another one are forgotten.
        kept: The file in which they stand.
    """
    before = json.loads(kept.read_text(encoding="utf-8")) if kept.exists() else {}
    last = {
        one["name"]: Outcome(**one | {"lacks": tuple(one["lacks"])})
        for one in before.get(commit, ())
    }
    last |= {one.name: one for one in outcomes}
    known = [last[part.name] for part in PARTS if part.name in last]
    text = json.dumps({commit: [asdict(one) for one in known]}, indent=1)
    kept.write_text(f"{text}\n", encoding="utf-8")
    return known


def _say(line: str) -> None:
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


def chosen(names: Iterable[str]) -> list[Part]:
    """Return the parts of these names, all of them for none.

    Raises:
        SystemExit: There is no such part.
    """
    asked = [name.replace("-", " ") for name in names]
    if unknown := set(asked) - {part.name for part in PARTS}:
        known = ", ".join(part.name.replace(" ", "-") for part in PARTS)
        sys.exit(f"There is no part {', '.join(sorted(unknown))}, but {known}.")
    return [part for part in PARTS if not asked or part.name in asked]


def main(names: Sequence[str], night_h: float) -> int:
    """Run the parts, print the table and keep it; return the exit code."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    commit = _commit()
    heading = f"{commit}, {datetime.now(UTC):%Y-%m-%d %H:%M} UTC, {night_h:g} h"
    outcomes: list[Outcome] = []
    try:
        for part in chosen(names):
            _say(f"{part.name} ...")
            outcomes.append(carry_out(part, night_h))
            _say(f"{part.name}: {outcomes[-1].how} {outcomes[-1].said}".rstrip())
    finally:  # after Ctrl-C in the morning, report the parts that have ended
        known = with_those_of_before(outcomes, commit, FOLDER / "outcomes.json")
        text = "\n".join(table(known, heading)) + "\n"
        (FOLDER / "table.md").write_text(text, encoding="utf-8")
        _say(text)
    return 1 if any(one.how == "FAILED" for one in outcomes) else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:], float(os.environ.get("NIGHT") or 8)))
