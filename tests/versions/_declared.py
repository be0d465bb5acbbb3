"""The declarations of pyproject.toml, and the tried versions."""

import json
import tomllib
from pathlib import Path
from typing import Any, Final

from packaging.requirements import Requirement
from packaging.version import Version

ROOT: Final = Path(__file__).parents[2]
TRIED: Final = Path(__file__).with_name("tried.json")

NEVER: Final = ("dev", "browser", "docs")
"""Extras for people who work on robolink; using it needs none of them."""

PYTHONS: Final = ("3.11", "3.12", "3.13", "3.14")
"""The versions of Python that ``make versions`` looks for, the lowest first."""

_OF_A_PLANT: Final = ("asyncua", "paho-mqtt", "prometheus-client")

UNTRIED: Final = {
    "newest-3.12": frozenset(_OF_A_PLANT),
    "newest-3.13": frozenset(_OF_A_PLANT),
    "newest-3.14": frozenset(
        {
            *_OF_A_PLANT,
            *("cryptography", "starlette", "uvicorn", "websockets"),
            *("opencv-python-headless", "pillow", "dbos", "sqlalchemy"),
        }
    ),
}
"""Packages that a run has not had yet: they came after it, and the machine had no such Python.
"""

_CLASSIFIER: Final = "Programming Language :: Python :: 3."


def project() -> dict[str, Any]:
    """Return the table ``[project]``."""
    document = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    found: dict[str, Any] = document["project"]
    return found


def run_time_dependencies() -> list[Requirement]:
    """Return the packages that a user installs, extras included."""
    declared = project()
    lines = [*declared["dependencies"]]
    for extra, wanted in declared["optional-dependencies"].items():
        lines += wanted if extra not in NEVER else []
    return [Requirement(line) for line in dict.fromkeys(lines)]  # two extras want Pillow


def lowest(requirement: Requirement) -> Version:
    """Return the lowest version that a requirement allows."""
    (version,) = (part.version for part in requirement.specifier if part.operator == ">=")
    return Version(version)


def pythons() -> list[str]:
    """Return the versions of Python that the classifiers name, such as ``3.11``."""
    return [
        f"3.{line.removeprefix(_CLASSIFIER)}"
        for line in project()["classifiers"]
        if line.startswith(_CLASSIFIER)  # "3 :: Only" has no dot
    ]


def tried() -> dict[str, Any]:
    """Return the results that ``make versions`` wrote for a passed run."""
    found: dict[str, Any] = json.loads(TRIED.read_text(encoding="utf-8"))
    return found
