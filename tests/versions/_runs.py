"""The runs of ``make versions``: each with its Python, its packages and its purpose."""

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any, Final

from packaging.version import Version

from tests.versions._beneath import FAILING
from tests.versions._declared import (
    NEVER,
    PYTHONS,
    ROOT,
    TRIED,
    lowest,
    project,
    run_time_dependencies,
    tried,
)
from tests.versions._environment import CHOSEN, TOOLS, Environment

FOLDER: Final = ROOT / "build" / "versions"


@dataclass(frozen=True, slots=True)
class Run:
    """One line of the table.

    Attributes:
        name: Its name on the command line and in ``tried.json``.
        carry_out: Takes the folder of its environment; returns the result to keep.
    """

    name: str
    carry_out: Callable[[Path], dict[str, Any]]


def runs() -> Iterator[Run]:
    """Yield all runs: the lowest versions, the releases below them, the newest on each Python."""
    first, *_ = PYTHONS
    yield Run(f"lowest-{first}", partial(with_the_lowest, first))
    for name in FAILING:
        yield Run(f"beneath-{name}", partial(beneath, name, first))
    for version in PYTHONS:
        yield Run(f"newest-{version}", partial(with_the_newest, version))


def pins() -> list[str]:
    """Return each dependency at its lowest version, as a pip requirement."""
    return [
        f"{wanted.name}{'[binary]' if wanted.extras else ''}=={lowest(wanted)}"
        for wanted in run_time_dependencies()
    ]


def with_the_lowest(python: str, folder: Path) -> dict[str, Any]:
    """Run the demonstration and the chosen tests with exactly the lowest versions.

    Raises:
        NotRunError: This machine lacks a Python or a package.
        AssertionError: Something did not pass.
    """
    environment = lowest_environment(python, folder)
    environment.demonstrate()
    shown = environment.test(CHOSEN)
    return {"tests": shown, "versions": _installed(environment)}


def lowest_environment(python: str, folder: Path) -> Environment:
    """Return an environment with exactly the lowest version of each dependency."""
    environment = Environment(folder, python)
    environment.install([*pins(), *TOOLS])
    environment.install_sources()
    found = _installed(environment)
    wanted = run_time_dependencies()
    wrong = [one.name for one in wanted if Version(found[one.name]) != lowest(one)]
    assert not wrong, f"not at their lowest versions: {wrong}"
    return environment


def beneath(name: str, python: str, folder: Path) -> dict[str, Any]:
    """Show that the release below the lowest of one dependency does not work.

    Raises:
        NotRunError: This machine lacks a Python or a package.
        AssertionError: The tests pass with it: the declared bound is too high.
    """
    version, test = FAILING[name]
    environment = lowest_environment(python, folder)
    environment.test([test])  # with the lowest it serves
    ahead = folder / "beneath"
    environment.install([f"{name}=={version}"], into=ahead)
    failed = environment.failure(test, ahead=ahead)
    assert failed, f"{test} passes with {name} {version} as well"
    return {"version": version, "test": test, "failed": failed}


def with_the_newest(python: str, folder: Path) -> dict[str, Any]:
    """Run the demonstration and the chosen tests with the newest allowed versions.

    Raises:
        NotRunError: This machine lacks a Python or a package.
        AssertionError: Something did not pass.
    """
    environment = Environment(folder, python)
    extras = ",".join(sorted(set(project()["optional-dependencies"]) - set(NEVER)))
    environment.install([*TOOLS, "--editable", f"{ROOT}[{extras}]"])
    environment.demonstrate()
    shown = environment.test(CHOSEN)
    return {"tests": shown, "versions": _installed(environment)}


def keep(name: str, result: dict[str, Any]) -> None:
    """Write the result of a run, with the date, into ``tried.json``."""
    kept = tried() if TRIED.exists() else {}
    kept[name] = {"date": datetime.now(UTC).date().isoformat(), **result}
    ordered = {run.name: kept[run.name] for run in runs() if run.name in kept}
    TRIED.write_text(json.dumps(ordered, indent=2) + "\n", encoding="ascii")


def _installed(environment: Environment) -> dict[str, str]:
    return environment.versions([wanted.name for wanted in run_time_dependencies()])
