"""The verdict on each row after a run of the marked tests; a test not run has not passed."""

from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Final

from tests.faults.catalogue._rows import Row
from tests.faults.catalogue._shown_by import Showing

NO_HARDWARE: Final = ("no hardware", "no motion on hardware")
"""How tests begin that skip for want of a real controller. The catalogue is about the simulators,
so such a column takes nothing from a row; how many there were is printed apart."""


@dataclass(slots=True)
class Ends:
    """The outcomes of the parameters of one test."""

    passed: int = 0
    failed: int = 0
    why_skipped: list[str] = field(default_factory=list)
    on_hardware: int = 0


@dataclass(frozen=True, slots=True)
class Verdict:
    """One line of the table."""

    row: Row
    word: str
    """``passed``, ``in part``, ``FAILED`` or ``not run``."""
    tests: int
    """The number of passed tests, each parameter counted."""
    why: str
    """What is missing, or failed; empty if the whole row was shown."""

    @property
    def line(self) -> str:
        """The line as it is printed."""
        count = f"{self.tests:4d} tests" if self.tests != 1 else "   1 test "
        why = f" ({self.why})" if self.why else ""
        return f"{self.row.id}  {self.word:8}{count}  {self.row.fault}{why}"


def judged(row: Row, showings: Iterable[Showing], ends: dict[str, dict[str, Ends]]) -> Verdict:
    """Return the verdict of a run on ``row``.

    Args:
        row: The row.
        showings: The tests marked with any row.
        ends: The outcomes, by row and by the test's name in pytest without parameters.
    """
    of_row = ends.get(row.id, {})
    passed = sum(end.passed for end in of_row.values())
    if broken := sorted(node for node, end in of_row.items() if end.failed):
        return Verdict(row, "FAILED", passed, "; ".join(broken))
    expected = {s.node for s in showings if row.id in s.faults}
    missing = sorted(n for n in expected if n not in of_row or not of_row[n].passed)
    reasons = list(dict.fromkeys(w for end in of_row.values() for w in end.why_skipped))
    left = [*missing, *reasons, row.not_shown]
    if passed:
        why = "; ".join(filter(None, left))
        return Verdict(row, "in part" if why else "passed", passed, why)
    return Verdict(row, "not run", 0, row.not_run or "; ".join(filter(None, left)) or "no test")


class Listener:
    """A pytest plug-in that records the outcome of each marked test, also from other processes."""

    def __init__(self) -> None:
        self.ends: dict[str, dict[str, Ends]] = defaultdict(lambda: defaultdict(Ends))

    def pytest_runtest_logreport(self, report) -> None:
        """Count one phase of one test."""
        test = report.nodeid.partition("[")[0]
        # The rows come with the report: the process that prints has no items.
        for row in {value for key, value in report.user_properties if key == "fault"}:
            end = self.ends[row][test]
            if report.failed:
                end.failed += 1
            elif report.skipped:
                why = str(report.longrepr[2]).removeprefix("Skipped: ")
                if why.startswith(NO_HARDWARE):
                    end.on_hardware += 1
                else:
                    end.why_skipped.append(why)
            elif report.when == "call":
                end.passed += 1
