"""``make versions``: the named runs, or all of them; a table with the end of each."""

import shutil
import sys

from tests.versions._environment import NotRunError
from tests.versions._runs import FOLDER, Run, keep, runs


def main() -> int:
    """Return 0 if every requested run passed; a run that did not take place has not passed."""
    asked = sys.argv[1:]
    known = list(runs())
    if unknown := set(asked) - {run.name for run in known}:
        print("There is no run", *sorted(unknown), "but", *(run.name for run in known))
        return 2
    ends = [end(run) for run in known if not asked or run.name in asked]
    return 0 if all(passed for passed in ends) else 1


def end(run: Run) -> bool:
    """Carry out a run, print its end, keep its output; return whether it passed."""
    folder = FOLDER / run.name
    try:
        result = run.carry_out(folder)
    except NotRunError as lack:
        print(f"{run.name:20} NOT RUN  {lack}", flush=True)
        return False
    except AssertionError as failure:
        print(f"{run.name:20} FAILED\n{failure}", flush=True)
        return False
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    keep(run.name, result)
    print(f"{run.name:20} passed   {result.get('tests') or result.get('failed')}", flush=True)
    return True


if __name__ == "__main__":
    sys.exit(main())
