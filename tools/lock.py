"""Names every package that robolink is installed with, by version and hash.

``make lock`` asks pip which versions fit and writes two files. ``requirements.lock`` is what runs,
for the offline PC: Python 3.11, Linux with glibc 2.17 or Windows; ``make wheelhouse`` gathers just
that. ``requirements-dev.lock`` is what tests and builds besides; CI installs it. Both are given to
pip with ``--require-hashes``: a wheel that is not byte for byte the one that was tested is refused.

pip's own report is all that is used, so no index is named here: whichever index pip is set up with
is asked. For other systems and Pythons pip is asked again for the same versions, since their wheels
are other files.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT: Final = Path(__file__).parents[1]

_GLIBC: Final = tuple(f"manylinux_2_{minor}" for minor in range(41, 16, -1))
SYSTEMS: Final[Mapping[str, tuple[str, ...]]] = {
    "old linux": ("manylinux2014_x86_64",),
    "linux": tuple(f"{tag}_x86_64" for tag in (*_GLIBC, "manylinux2014", "linux")),
    "win32": ("win_amd64",),
}
"""Wheel platforms that each system accepts, the best first."""

_LINUX: Final = {
    "sys_platform": "linux",
    "platform_system": "Linux",
    "platform_machine": "x86_64",
    "os_name": "posix",
}
_WINDOWS: Final = {
    "sys_platform": "win32",
    "platform_system": "Windows",
    "platform_machine": "AMD64",
    "os_name": "nt",
}


@dataclass(frozen=True, slots=True)
class LockFile:
    """What a file is for.

    Attributes:
        name: Of the file.
        systems: Those of :data:`SYSTEMS` that it serves; versions are chosen for the first.
        pythons: The versions of Python; the first likewise.
        dev: Whether it holds what tests and builds.
    """

    name: str
    systems: tuple[str, ...]
    pythons: tuple[str, ...]
    dev: bool

    @property
    def targets(self) -> list[tuple[str, str]]:
        """Each system with each Python."""
        return [(system, python) for system in self.systems for python in self.pythons]


FILES: Final = (
    LockFile("requirements.lock", ("old linux", "win32"), ("3.11",), dev=False),
    LockFile("requirements-dev.lock", ("linux", "win32"), ("3.11", "3.12", "3.13"), dev=True),
)

Report = Mapping[str, Any]
"""One package of pip's report."""


class Packages:
    """What was found: versions, what each asks for, and the hashes of its wheels."""

    def __init__(self) -> None:
        self.version: dict[str, str] = {}
        self.asks: dict[str, list[Requirement]] = {}
        self.hashes: dict[str, set[str]] = {}

    def take(self, reports: Iterable[Report]) -> None:
        """Note what pip would install; a local folder, such as ours, is none of it."""
        for report in reports:
            hashes = report["download_info"].get("archive_info", {}).get("hashes", {})
            if not hashes:
                continue
            about = report["metadata"]
            name = canonicalize_name(about["name"])
            if self.version.setdefault(name, about["version"]) != about["version"]:
                raise SystemExit(f"{name}: two versions, {self.version[name]} and another")
            self.asks[name] = [Requirement(text) for text in about.get("requires_dist", ())]
            self.hashes.setdefault(name, set()).add(hashes["sha256"])

    def needed(self, roots: Iterable[Requirement], environment: Mapping[str, str]) -> set[str]:
        """Return what the roots need, and what that needs, on a system.

        A name that is not known yet is among it.
        """
        found: set[tuple[str, str]] = set()
        left = [(root, "") for root in roots]
        while left:
            wanted, extra = left.pop()
            if wanted.marker and not wanted.marker.evaluate({**environment, "extra": extra}):
                continue
            name = canonicalize_name(wanted.name)
            for asked in ("", *wanted.extras):
                if (name, asked) not in found:
                    found.add((name, asked))
                    left += [(further, asked) for further in self.asks.get(name, ())]
        return {name for name, _ in found}


def asked(*arguments: str) -> list[Report]:
    """Return what pip would install.

    Raises:
        SystemExit: It cannot; pip has said why.
    """
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "report.json"
        command = [sys.executable, "-m", "pip", "install", "--quiet", "--dry-run"]
        command += ["--ignore-installed", "--report", str(report), *arguments]
        if subprocess.run(command, check=False).returncode:
            raise SystemExit(1)
        found: list[Report] = json.loads(report.read_bytes())["install"]
        return found


def elsewhere(system: str, python: str) -> list[str]:
    """Return the options with which pip answers for another system and Python."""
    platforms = [word for tag in SYSTEMS[system] for word in ("--platform", tag)]
    options = ["--only-binary=:all:", "--implementation=cp", "--python-version", python]
    return [*options, *platforms, "--target", str(ROOT / "build" / "never-made")]


def environment_of(system: str, python: str) -> dict[str, str]:
    """Return what markers are judged by there."""
    names = _WINDOWS if system == "win32" else _LINUX
    return {**names, "python_version": python, "python_full_version": f"{python}.0"}


def roots(*, dev: bool) -> list[Requirement]:
    """Return what runs, and with ``dev`` also what is needed to test and build."""
    document = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    project = document["project"]
    wanted = [*project["dependencies"]]
    if dev:
        wanted += project["optional-dependencies"]["dev"]
        # Packages that hatchling needs for an editable install, and cannot declare beforehand.
        wanted += [*document["build-system"]["requires"], "editables"]
    return list(map(Requirement, wanted))


def resolved(file: LockFile) -> Packages:
    """Return the versions that fit, and the hashes of all their wheels."""
    packages, wanted = Packages(), roots(dev=file.dev)
    packages.take(asked(*elsewhere(*file.targets[0]), *map(str, wanted)))
    for system, python in file.targets:
        environment = environment_of(system, python)
        # pip evaluates markers for its own computer: packages for another one are requested here.
        while missing := packages.needed(wanted, environment) - set(packages.version):
            packages.take(asked("--no-deps", *elsewhere(system, python), *sorted(missing)))
        names = packages.needed(wanted, environment)
        pins = [f"{name}=={packages.version[name]}" for name in sorted(names)]
        packages.take(asked("--no-deps", *elsewhere(system, python), *pins))
    return packages


def text_of(file: LockFile, packages: Packages) -> str:
    """Return a lock file."""
    wanted = roots(dev=file.dev)
    needed: dict[str, set[str]] = {}
    for system, python in file.targets:
        for name in packages.needed(wanted, environment_of(system, python)):
            needed.setdefault(name, set()).add(system)
    lines = [
        "# Made by `make lock`. pip takes nothing else with --require-hashes.",
        f"# Python {', '.join(file.pythons)}; {', '.join(file.systems)}; 64 bit.",
    ]
    for name, systems in sorted(needed.items()):
        here = ' ; sys_platform == "win32"' if systems == {"win32"} else ""
        hashes = [f"    --hash=sha256:{value}" for value in sorted(packages.hashes[name])]
        lines.append(" \\\n".join([f"{name}=={packages.version[name]}{here}", *hashes]))
    return "\n".join(lines) + "\n"


def main() -> None:
    """Write both files."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    for file in FILES:
        text = text_of(file, resolved(file))
        (ROOT / file.name).write_text(text, encoding="ascii")


if __name__ == "__main__":
    main()
