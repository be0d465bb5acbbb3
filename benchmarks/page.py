"""Writes docs/performance.md and its pictures from one whole run."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from benchmarks.pictures import Growth, picture
from benchmarks.quiet import SPREAD
from benchmarks.table import HEAD, Figure

ROOT: Final = Path(__file__).parents[1]
PAGE: Final = ROOT / "docs" / "performance.md"
PICTURES: Final = ROOT / "docs" / "pictures"

TITLES: Final = {
    "exchange": "One exchange",
    "transaction": "A tool write that is recorded and read back",
    "mailbox": "A tool write through a PLC's mailbox",
    "fleet": "Thousands of simulated controllers",
    "start-up": "Start of the command line",
    "stopping": "A stop, and a look",
    "panel": "The panel",
    "journal": "A large journal",
    "nozzle-change": "A nozzle change in process",
    "virtual-time": "Cells in virtual time",
    "solvers": "Solvers",
    "kinematics": "Kinematics of the simulated robot",
    "spel-programs": "SPEL+ programs",
    "plc-program": "The PLC program",
    "eye": "The finder of tips",
}

NOTES: Final = {
    "transaction": "Both sides make two durable commits. In ours each holds what a recovery needs:"
    "\nmarker, lease, head of the chain, entries and their indexes; together they put"
    "\n27 KiB into the write-ahead file, the floor's commits 8. In memory (the least of"
    "\n1,500 writes) a write takes 0.39 ms of processor time: 0.22 for the record, 0.04"
    "\nfor the three exchanges, the rest for values, checks and comparisons. The floor's"
    "\nwrite-ahead file grows with each commit; ours starts again from its beginning"
    "\nafter some ten writes, which takes the disk a little more than half the time.",
    "fleet": "Controllers are made when they are first used, so opening them is cheap; both states"
    "\nare shown. The client is a bare selector in a process of its own.",
    "nozzle-change": "Simulated times and requests are the same on every machine. In the recipe"
    "\nneedle-beams a needle is measured on two light beams, its shaft is checked and its"
    "\nturn test made, without a person.",
    "virtual-time": "The real driver, every check, a record in memory: a change is some 165"
    "\nrequests to the simulated controller and 22 movements, of which each is"
    "\nannounced, limited, watched and recorded as on a real robot. What is wanted of"
    "\nfleets follows from what is wanted of one change. The last four lines are cells"
    "\nthat are asked once a simulated second, with a write now and then, done by the"
    "\nreal driver (a tool a minute is compared, written, read back and recorded), in"
    "\none process and divided among as many as there are CPUs: cells know nothing of"
    "\neach other.",
    "panel": "Robot, panel and job are processes of their own. The parts of a page are drawn"
    "\nonce for all tablets that see the same, here twice: for the one that has the seat,"
    "\nand for those that watch.",
    "eye": "The pictures are drawings. Where no radius is stated, all sizes are tried.",
    "solvers": "Where lstsq with covariance is the floor, it starts from arrays. A calibration"
    "\ngets poses, each with a hand, a tool and a local: to read and compare these"
    "\ntakes 115 us for 1,000 poses on four axes, a quarter of the whole. Each side"
    "\nuses one thread, and the two are measured in turn, one pair at a time.",
}
"""Notes that explain the figures of a case."""

_TOP: Final = """# Performance

*For maintainers. Reference.*

`make bench` measures all of this and writes this page; `make bench ONLY=fleet` runs one part and
prints it. `build/bench.json` then has all measured numbers. Each figure is a median. It is compared
with a floor (the least work that the task needs), a peer (what others offer) or a
wanted value. Floor or peer is measured in the same run, in turn with ours. The ratio is ours over
theirs, so less is always better; where a rate is wanted, it is the wanted rate over ours. Compare
ratios, and only within a run: the times depend on the machine.

Before and after each part the same small piece of work is timed. If it ever took more than
{spread:g} times its fastest time, the machine was doing something else as well: nothing is
published, and `make bench` ends with 3. `NOISY=yes` publishes all the same, and this page then
says so.
"""

_GROWTH: Final = """
## How it grows

Both axes are logarithmic.
"""


def publish(
    about: Mapping[str, Any], cases: Mapping[str, Sequence[Figure]], growth: Sequence[Growth]
) -> None:
    """Write the page and its pictures.

    Args:
        about: When, where, with what versions, and how noisy it was.
        cases: The figures, by the names of their cases.
        growth: What is drawn.
    """
    for one in growth:
        (PICTURES / f"{one.name}.svg").write_text(picture(one), encoding="utf-8")
    PAGE.write_text("\n".join(_lines(about, cases, growth)) + "\n", encoding="utf-8")


def _lines(
    about: Mapping[str, Any], cases: Mapping[str, Sequence[Figure]], growth: Sequence[Growth]
) -> Iterator[str]:
    yield _TOP.format(spread=SPREAD)
    yield from _circumstances(about)
    missed = [one for figures in cases.values() for one in figures if one.met is False]
    met = sum(one.met is True for figures in cases.values() for one in figures)
    yield f"\nGoals met: {met} of {met + len(missed)}."
    for one in missed:
        yield f"* missed: {one.name} ({one.ratio:.2f}, goal {one.goal:.2f})."
    for name, figures in cases.items():
        yield f"\n## {TITLES[name]}\n"
        if name in NOTES:
            yield f"{NOTES[name]}\n"
        yield _row(HEAD)
        yield "|---|---|---:|---:|---:|---:|---|"
        yield from (_row(figure.cells()) for figure in figures)
    yield _GROWTH
    yield from (f"![{one.title}](pictures/{one.name}.svg)" for one in growth)


def _circumstances(about: Mapping[str, Any]) -> Iterator[str]:
    yield f"Measured on {about['date']}: {about['machine']}."
    yield f"Versions: {', '.join(f'{name} {it}' for name, it in about['versions'].items())}."
    if about["quiet"]:
        yield f"Between the parts {about['noise']}."
    else:
        yield f"**The machine was busy with other work**: between the parts {about['noise']}; load"
        yield f"{about['load']}. The figures are worse than on a quiet one, and goals are missed."


def _row(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cell.replace('|', '/') for cell in cells)} |"
