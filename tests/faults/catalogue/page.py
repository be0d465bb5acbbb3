"""The page of all faults, made from the catalogue and the marks of the tests: docs/faults.md.

``python -m tests.faults.catalogue.page`` prints it.
"""

from collections.abc import Iterator
from typing import Final

from tests.faults.catalogue._rows import Row, groups
from tests.faults.catalogue._shown_by import Showing, showings

_OPENING: Final = """\
# Faults

*For maintainers. Reference.*

What can go wrong between a PC and a robot, what you see then, and what never happens. This page is
made from the catalogue in `tests/faults/catalogue/rows` and the marks of the tests:
`python -m tests.faults.catalogue.page > docs/faults.md`.

`make faults` runs the tests of all rows and prints the table with pass marks,
`make faults ROWS="F01 F25"` those of some. A row that cannot be shown on the machine at hand is
printed as *not run*, with the reason. All of it is checked against the simulators, not against a
robot or a PLC, and on Linux: what of it holds on another system, no row shows. *Unproved* means
exit code 6: it may or may not have happened, and nothing moves on that controller until somebody
has looked ([recovery](reference/recovery.md)). Tests marked *soak* take long; they run with
`make faults` and `make soak`, not with `make test`.
"""
_HEAD: Final = (
    "| | fault | what you see | what never happens | how it is brought about | shown by |",
    "|---|---|---|---|---|---|",
)


def page() -> str:
    """Return the page."""
    lines = [_OPENING]
    for group in groups():
        lines += [f"## {group.title}", "", *_HEAD, *map(_line, group.rows), ""]
    return "\n".join(lines)


def _line(row: Row) -> str:
    cells = (row.id, row.fault, row.sees, row.never, row.injected, _shown_by(row))
    # A bar would end the table cell.
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _shown_by(row: Row) -> str:
    if row.not_run:
        return f"not run: {row.not_run}"
    shown = ", ".join(_names([s for s in showings() if row.id in s.faults]))
    return f"{shown}. Not shown: {row.not_shown}" if row.not_shown else shown


def _names(tests: list[Showing]) -> Iterator[str]:
    """Yield each file once; marked soak if none of its tests is in the default suite."""
    for file in dict.fromkeys(test.file for test in tests):
        soak = all(test.soak for test in tests if test.file == file)
        yield f"`{file}`" + (" (soak)" if soak else "")


if __name__ == "__main__":
    print(page(), end="")
