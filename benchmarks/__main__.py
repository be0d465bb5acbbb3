"""Measure, print the table, write build/bench.json; a whole run on a quiet machine is published.

python -m benchmarks [CASE ...] [--publish [--noisy]]
"""

import argparse
import json
import os
import platform
import sys
import tempfile

# Before numpy is loaded: on small systems a second thread of its library only waits, and if
# other work uses the second processor, a floor takes seven times as long as with one thread.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# Installed packages have bytecode. In a shell that forbids writing it, every measured process
# would compile all modules that changed since writing was last allowed.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from time import perf_counter
from typing import Any, Final

from benchmarks.cases import CASES, measured_alone
from benchmarks.growth import measured_growth
from benchmarks.page import PAGE, ROOT, publish
from benchmarks.quiet import SPREAD, Floors, load_average
from benchmarks.table import Figure, print_table

JSON: Final = ROOT / "build" / "bench.json"
SCHEMA: Final = "robolink/bench/1"
TOO_NOISY: Final = 3

_PACKAGES: Final = ("numpy", "scipy", "pymodbus", "canopen", "click", "lark")


def main() -> int:
    """Run what was asked for; return the exit code.

    The records of the measured commands are gone at its end: they are nobody's, and a change that
    was cut off with a run would forbid movements in the next.
    """
    asked = _arguments()
    with tempfile.TemporaryDirectory(prefix="robolink-bench-") as folder:
        os.environ["ROBOLINK_STATE_DIR"] = folder
        os.environ.pop("ROBOLINK_JOURNAL", None)
        return _measure(asked)


def _measure(asked: argparse.Namespace) -> int:
    floors, cases, seconds = Floors(), dict[str, list[Figure]](), dict[str, float]()
    floors.look()
    for name in asked.cases or CASES:
        began = perf_counter()
        cases[name] = measured_alone(name)
        seconds[name] = perf_counter() - began
        floors.look()
        print(f"\n{name}: {seconds[name]:.0f} s")
        print_table(cases[name])
    growth = list(measured_growth()) if asked.publish else []
    floors.look()
    about = {**_circumstances(), "floors_us": floors.taken_us}
    about |= {"spread": floors.spread, "quiet": floors.quiet, "noise": str(floors)}
    _write(about, cases, seconds, growth)
    print(f"\n{about['machine']}; load {about['load']}; {floors}; {JSON}")
    if not asked.publish:
        return 0
    if not (floors.quiet or asked.noisy):
        return refuse_to_publish()
    publish(about, cases, growth)
    print(f"Written: {PAGE} and its pictures.")
    return 0


def refuse_to_publish() -> int:
    """Say that the figures are not to be believed; return the exit code."""
    said = f"Not published: the machine did something else meanwhile (spread over {SPREAD:g})."
    print(said, file=sys.stderr)
    return TOO_NOISY


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("cases", nargs="*", metavar="CASE", help=f"of: {', '.join(CASES)}")
    parser.add_argument("--publish", action="store_true", help="write docs/performance.md")
    parser.add_argument("--noisy", action="store_true", help="publish all the same, and say so")
    asked = parser.parse_args()
    if unknown := [name for name in asked.cases if name not in CASES]:
        parser.error(f"there is no case {unknown[0]!r}; known are {', '.join(CASES)}")
    if asked.cases and asked.publish:
        parser.error("only a whole run is published")
    return asked


def _circumstances() -> dict[str, Any]:
    return {
        "schema": SCHEMA,
        "date": datetime.now(UTC).strftime("%d %B %Y").lstrip("0"),
        "machine": _machine(),
        "load": load_average(),
        "versions": {
            "Python": platform.python_version(),
            **{name: metadata.version(name) for name in ("robolink", *_PACKAGES)},
        },
    }


def _machine() -> str:
    """Return processor, how many, and system."""
    cpu = platform.processor() or platform.machine()
    told = Path("/proc/cpuinfo")
    if told.exists():
        models = [line for line in told.read_text().splitlines() if line.startswith("model name")]
        cpu = models[0].partition(":")[2].strip() if models else cpu
    return f"{os.cpu_count()} CPUs, {cpu}, {platform.system()} {platform.release()}"


def _write(
    about: dict[str, Any],
    cases: dict[str, list[Figure]],
    seconds: dict[str, float],
    growth: list[Any],
) -> None:
    JSON.parent.mkdir(exist_ok=True)
    document = {
        **about,
        "cases": {
            name: {"seconds": seconds[name], "figures": [one.document() for one in figures]}
            for name, figures in cases.items()
        },
        "growth": {one.name: one.points for one in growth},
    }
    JSON.write_text(json.dumps(document, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
