"""``python -m tests.mutants.adversary FOLDER``: record the lines that the adversary executes.

Its histories are the same each time, so it cannot find a mutant in another line.
"""

import sys
from pathlib import Path

import coverage

from tests.mutants.places import PACKAGES, ROOT


def main() -> int:
    """Run the two hundred hours without a mutant; 1 if a rule is broken then."""
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    seen = coverage.Coverage(
        data_file=str(folder / "lines"),
        source=[str(ROOT / package) for package in PACKAGES],
        config_file=False,
    )
    seen.start()
    from tests.soak.known_defects import KnownDefect
    from tests.soak.mutant_table import search_for

    search = search_for(KnownDefect("nothing is changed", {}))
    seen.stop()
    seen.save()
    return 1 if search.rule else 0


if __name__ == "__main__":
    sys.exit(main())
