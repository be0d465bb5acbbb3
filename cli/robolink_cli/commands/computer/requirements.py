"""Whether the packages installed here are the ones that robolink asks for."""

import re
import sys
from collections.abc import Iterator
from functools import partial
from importlib import metadata
from pathlib import Path
from typing import Final, NamedTuple

import robolink
from robolink.messages import tr
from robolink_cli.commands.computer.doctor_finding import Level, Remark, guarded

_REQUIREMENT: Final = re.compile(
    r"(?P<name>[\w.-]+)\s*(\[[^]]*])?\s*\(?(?P<range>[^;()]*)\)?"
    r"(;.*extra\s*==\s*['\"](?P<extra>[^'\"]+)['\"].*)?"
)
_DEVELOPMENT: Final = frozenset({"dev", "docs"})


class Requirement(NamedTuple):
    """A package, the versions of it that will do, and the extra that asks for it."""

    name: str
    versions: str
    extra: str | None


def requirement(text: str) -> Requirement:
    """Read one line of a package's metadata.

    Raises:
        ValueError: It is no requirement, or depends on something else than an extra.
    """
    match = _REQUIREMENT.fullmatch(text)
    if match is None:
        raise ValueError(text)
    return Requirement(match["name"], match["range"].strip(), match["extra"])


def fits(version: str, versions: str) -> bool:
    """Tell whether a version lies in a range such as ``>=8.1,<9``; numbers only.

    Raises:
        ValueError: The range uses an operator that robolink does not.
    """
    found = _numbers(version)
    for part in filter(None, (part.strip() for part in versions.split(","))):
        match = re.fullmatch(r"(>=|<=|==|!=|<|>)\s*([\d.]+)", part)
        if match is None:
            raise ValueError(versions)
        operator, limit = match[1], _numbers(match[2])
        kept = {
            ">=": found >= limit,
            "<=": found <= limit,
            "==": found == limit,
            "!=": found != limit,
            "<": found < limit,
            ">": found > limit,
        }[operator]
        if not kept:
            return False
    return True


def check_versions() -> Iterator[Remark]:
    """Compare Python and every package with what robolink's own metadata ask for."""
    try:
        own = metadata.distribution("robolink")
    except metadata.PackageNotFoundError:
        yield Remark(
            "robolink",
            Level.WARN,
            tr("it runs from a folder and is not installed, so versions were not compared."),
            tr("Run: python -m pip install robolink"),
        )
        return
    yield _python(own.metadata["Requires-Python"])
    for text in own.requires or ():
        yield from guarded(text, partial(_required, text))


def check_name() -> Iterator[Remark]:
    """Look for anything else that calls itself ``robolink``."""
    own = Path(robolink.__file__).parent
    others = sorted(set(metadata.packages_distributions().get("robolink", ())) - {"robolink"})
    for other in others:
        yield Remark(
            "name",
            Level.BAD,
            tr("the package {other} brings a 'robolink' of its own.", other=other),
            tr(
                "Keep the two apart: install this robolink in an environment of its own, and "
                "uninstall {other} here.",
                other=other,
            ),
        )
    shadows = [path for path in _homes() if path.resolve() != own.resolve()]
    for path in shadows:
        yield Remark(
            "name",
            Level.WARN,
            tr("{path} would be imported as robolink elsewhere.", path=path),
            tr("Rename or remove it; robolink itself runs from {own}.", own=own),
        )
    if not others and not shadows:
        yield Remark("name", Level.OK, tr("nothing else calls itself robolink."))


def _homes() -> Iterator[Path]:
    for folder in dict.fromkeys(sys.path):
        base = Path(folder)
        if (base / "robolink" / "__init__.py").is_file():
            yield base / "robolink"
        if (base / "robolink.py").is_file():
            yield base / "robolink.py"


def _python(versions: str) -> Remark:
    version = ".".join(str(number) for number in sys.version_info[:3])
    if fits(version, versions):
        return Remark("python", Level.OK, version)
    return Remark(
        "python",
        Level.BAD,
        tr("{version} is installed, {versions} is needed.", version=version, versions=versions),
        tr("Install robolink with a newer Python."),
    )


def _required(text: str) -> Iterator[Remark]:
    wanted = requirement(text)
    if wanted.extra not in _DEVELOPMENT:
        yield _package(wanted)


def _package(wanted: Requirement) -> Remark:
    ask = f"{wanted.name}{wanted.versions}"
    install = tr("Run: python -m pip install '{ask}'", ask=ask)
    try:
        version = metadata.version(wanted.name)
    except metadata.PackageNotFoundError:
        if wanted.extra:
            return Remark(wanted.name, Level.OK, tr("not installed; it is optional."))
        return Remark(wanted.name, Level.BAD, tr("is not installed."), install)
    if fits(version, wanted.versions):
        return Remark(wanted.name, Level.OK, version)
    level = Level.WARN if wanted.extra else Level.BAD
    what = tr(
        "{version} is installed, {versions} is needed.", version=version, versions=wanted.versions
    )
    return Remark(wanted.name, level, what, install)


def _numbers(version: str) -> tuple[int, ...]:
    """Return the release numbers, trailing zeros left out: 8.0 is 8."""
    match = re.match(r"\d+(\.\d+)*", version)
    numbers = [int(number) for number in match[0].split(".")] if match else []
    while numbers and numbers[-1] == 0:
        numbers.pop()
    return tuple(numbers)
