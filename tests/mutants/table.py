"""The results, on file, and as the table of docs/reliability.md, "Mutants by machine"."""

import hashlib
import json
import tomllib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from tests.mutants.changes import Kind, Mutant
from tests.mutants.judging import Judgement
from tests.mutants.places import ROOT


class Results:
    """Earlier judgements, and the review of the survivors.

    A judgement holds while its module has the same text; tests may change meanwhile.

    Args:
        file: The judgements, one a line; the first and the last of a mutant count.
        by_hand: The reviewed survivors.
    """

    def __init__(self, file: Path, by_hand: Path) -> None:
        self._file = file
        self._rows: dict[tuple[str, str], list[dict[str, Any]]] = {}
        for line in file.read_text().splitlines() if file.exists() else ():
            row = json.loads(line)
            self._rows.setdefault((row["module"], row["mutant"]), []).append(row)
        told = tomllib.loads(by_hand.read_text()) if by_hand.exists() else {}
        self._by_hand: dict[str, str] = {
            one["mutant"]: one["verdict"] for one in told.get("survivor", ())
        }

    def keep(self, mutant: Mutant, judgement: Judgement, commit: str) -> None:
        """Add a judgement."""
        key = _key(mutant)
        row = {
            "commit": commit,
            "module": key[0],
            "mutant": mutant.name,
            "kind": mutant.kind,
            "place": f"{mutant.file}:{mutant.line}",
            **judgement.plain(),
        }
        self._rows.setdefault(key, []).append(row)
        self._file.parent.mkdir(parents=True, exist_ok=True)
        with self._file.open("a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")

    def judged(self, mutant: Mutant) -> bool:
        """Return whether there is a judgement of its present form."""
        return _key(mutant) in self._rows

    def first(self, mutant: Mutant) -> dict[str, Any]:
        """Return its first judgement, before any reaction to it."""
        return self._rows[_key(mutant)][0]

    def last(self, mutant: Mutant) -> dict[str, Any]:
        """Return its last judgement."""
        return self._rows[_key(mutant)][-1]

    def survived(self, mutant: Mutant) -> bool:
        """Return whether neither the tests nor the adversary find it, as far as is known."""
        return self.judged(mutant) and self.last(mutant)["by"] == "neither"

    def verdict(self, mutant: Mutant) -> str:
        """Return a person's verdict, empty if nobody has looked."""
        return self._by_hand.get(mutant.name, "")


def _key(mutant: Mutant) -> tuple[str, str]:
    text = (ROOT / mutant.file).read_bytes()
    return hashlib.sha256(text).hexdigest()[:12], mutant.name


def table(chosen: Sequence[Mutant], results: Results) -> Iterator[str]:
    """Yield the table by kind, and the survivors one by one.

    Args:
        chosen: The drawn mutants.
        results: Their results, as far as they were judged.
    """
    judged = [one for one in chosen if results.judged(one)]
    yield f"{len(judged)} of {len(chosen)} drawn were judged."
    yield ""
    yield (
        "| kind | judged | killed by tests (of them by running out of time) | by the adversary "
        "| by neither | of them in a line that no test executes | killed by tests now |"
    )
    yield "|---|---:|---:|---:|---:|---:|---:|"
    for kind in (*Kind, None):
        rows = [results.first(one) for one in judged if kind in {one.kind, None}]
        last = [results.last(one) for one in judged if kind in {one.kind, None}]
        tests = [row for row in rows if row["by"] == "tests"]
        neither = [row for row in rows if row["by"] == "neither"]
        cells = (
            kind or "**all**",
            len(rows),
            f"{len(tests)} ({sum(row['how'] == 'hang' for row in tests)})",
            sum(row["by"] == "soak" for row in rows),
            len(neither),
            sum(not row["executed"] for row in neither),
            sum(row["by"] == "tests" for row in last),
        )
        yield "| " + " | ".join(map(str, cells)) + " |"
    yield ""
    yield "| place | change | what it is |"
    yield "|---|---|---|"
    for one in sorted(judged, key=lambda one: (one.file, one.line)):
        if results.first(one)["by"] == "neither":
            verdict = results.verdict(one) or "**not gone through**"
            change = one.change.replace("|", "\\|")
            yield f"| `{one.file}`, {one.where or 'module'} | `{change}` | {verdict} |"
