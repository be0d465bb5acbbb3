"""The checks of ``doctor``: this computer and its packages, never a controller."""

import os
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from enum import StrEnum
from functools import partial
from importlib import metadata
from pathlib import Path
from typing import Final, NamedTuple, TypeVar

import robolink
from robolink.errors import ConfigError
from robolink.files.durable import state_folder
from robolink.messages import declared, spoken, tr
from robolink.remedy_words import RemedyWord, remedy_word
from robolink.timing import local_label
from robolink_cli.commands.computer.lines import serial_ports
from robolink_cli.console.tables import padded

FoundT = TypeVar("FoundT")

_OWN_FILES: Final = re.compile(r"^robolink(?:/|\.py,)", re.MULTILINE)
"""A line of an installed package's list of files."""


class Level(StrEnum):
    """How serious it is; only BAD keeps robolink from working."""

    OK = declared("ok")
    WARN = declared("warn")
    BAD = declared("bad")


@dataclass(frozen=True, slots=True)
class Remark:
    """What was checked and found.

    Attributes:
        subject: Short name of what was looked at; the same in every language.
        level: How bad it is.
        what: What was found.
        remedy: What to do; empty when nothing has to be done.
    """

    subject: str
    level: Level
    what: str
    remedy: str = ""


def guarded(subject: str, look: Callable[[], Iterable[Remark]]) -> Iterator[Remark]:
    """Yield what a check finds; if it fails, one more remark says why.

    A driver, a keyring service or a package's metadata may fail in any way of its own, and whoever
    runs ``doctor`` needs the other looks then more than ever.

    Args:
        subject: Short name of what is looked at.
        look: Finds it out.
    """
    try:
        yield from look()
    except Exception as error:
        yield Remark(
            subject,
            Level.WARN,
            tr("this could not be checked ({error}).", error=failure(error)),
            tr("The other lines are still valid."),
        )


def tried(
    look: Callable[[], FoundT], problem: Callable[[str], str], problems: list[str]
) -> FoundT | None:
    """Return what a check finds, ``None`` if it fails.

    Args:
        look: Finds it out.
        problem: Makes the sentence for why it did not.
        problems: Takes that sentence.
    """
    try:
        return look()
    except Exception as error:
        problems.append(problem(failure(error)))
        return None


def failure(error: Exception) -> str:
    """Return the error of a failed check, in one line."""
    return " ".join(f"{type(error).__name__}: {error}".split()).rstrip(":")


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
    """Return whether a version lies in a range such as ``>=8.1,<9``; numbers only.

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
            tr("robolink runs from a folder and is not installed, so versions were not compared."),
            tr("Run: python -m pip install robolink"),
        )
        return
    yield _python(own.metadata["Requires-Python"])
    for text in own.requires or ():
        yield from guarded(text, partial(_required, text))


def check_name() -> Iterator[Remark]:
    """Look for anything else that calls itself ``robolink``."""
    own = Path(robolink.__file__).parent
    others = sorted(_packages_with_a_robolink() - {"robolink"})
    for other in others:
        yield Remark(
            "name",
            Level.BAD,
            tr("the package {other} has its own 'robolink'.", other=other),
            tr(
                "Install this robolink in a separate environment, and uninstall {other} here.",
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
        yield Remark("name", Level.OK, tr("no other package is called robolink."))


def _packages_with_a_robolink() -> set[str]:
    """Return the names of the installed packages that have a ``robolink`` at their top.

    ``metadata.packages_distributions`` would tell, but takes every list of files apart for it.
    """
    return {
        one.name
        for one in metadata.distributions()
        if "robolink" in (one.read_text("top_level.txt") or "").split()
        or _OWN_FILES.search(one.read_text("RECORD") or "")
    }


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


def check_up() -> list[Remark]:
    """Return everything that was checked, the worst first."""
    looks: dict[str, Callable[[], Iterable[Remark]]] = {
        "packages": check_versions,
        "name": check_name,
        "state": check_state_folder,
        "cells": check_cell_files,
        "keyring": check_keyring,
        "opcua": check_certificates,
        "serial": check_serial_ports,
        "lines": check_lines_of_cells,
        "journal": check_journal,
    }
    found = [remark for subject, look in looks.items() for remark in guarded(subject, look)]
    return sorted(found, key=lambda remark: list(Level).index(remark.level), reverse=True)


def in_words(remarks: Sequence[Remark]) -> Iterator[str]:
    """Yield the lines that a person reads, the verdict last."""
    for remark in remarks:
        yield f"{padded(spoken(remark.level), 4)}  {remark.subject}: {remark.what}"
        if remark.remedy:
            yield f"      {remark.remedy}"
    if any(remark.level is Level.BAD for remark in remarks):
        yield tr("Problems were found; see the first lines.")
    else:
        yield tr("No problem was found.")


def check_state_folder() -> Iterator[Remark]:
    """Check that backups can be kept; without one nothing is ever written."""
    folder = state_folder("backups")
    # On Windows the drive itself may be missing.
    above = (path for path in (folder, *folder.parents) if path.exists())
    existing = next(above, Path(folder.anchor))
    if not (existing.is_dir() and os.access(existing, os.W_OK | os.X_OK)):
        yield Remark(
            "state",
            Level.BAD,
            tr("backups cannot be kept in {folder}.", folder=folder),
            tr("Make {path} writable, or name another folder: ROBOLINK_STATE_DIR.", path=existing),
        )
    elif folder.exists() and _others_may(folder, 0o022):
        yield Remark(
            "state",
            Level.WARN,
            tr("others may change the backups in {folder}.", folder=folder),
            tr("Run: chmod go-w {folder}", folder=folder),
        )
    else:
        yield Remark("state", Level.OK, str(folder))


def check_cell_files() -> Iterator[Remark]:
    """Check each cell file, and who may change the addresses in it."""
    from robolink.config import cell_names, check_file, config_files

    files = [file.path for file in config_files() if file.present]
    for path in files:
        try:
            problems = check_file(path)
        except ConfigError as error:
            yield Remark("cells", Level.BAD, error.what, error.remedy)
            continue
        if problems:
            yield Remark(
                "cells",
                Level.BAD,
                tr("Errors in {path}: {count}.", path=path, count=len(problems)),
                tr("Run: robolink cell validate"),
            )
        elif _others_may(path, 0o002):
            yield Remark(
                "cells",
                Level.WARN,
                tr(
                    "anybody may change {path}, and so send commands to another controller.",
                    path=path,
                ),
                tr("Run: chmod o-w {path}", path=path),
            )
        else:
            yield Remark("cells", Level.OK, str(path))
    if files:
        yield Remark("cells", Level.OK, tr("cells: {names}.", names=", ".join(cell_names())))
    else:
        yield Remark("cells", Level.OK, tr("there is no cell file; -c takes a URL."))


def check_keyring() -> Iterator[Remark]:
    """Check that passwords can be kept in the system's keyring."""
    other = tr("A password can come from --password-file or ROBOLINK_PASSWORD.")
    try:
        import keyring
        from keyring.backends import fail
    except ImportError:
        yield Remark("keyring", Level.OK, tr("not installed; it is optional."), other)
        return
    found = keyring.get_keyring()
    if isinstance(found, fail.Keyring):
        yield Remark("keyring", Level.WARN, tr("this computer has no keyring service."), other)
    else:
        yield Remark("keyring", Level.OK, type(found).__module__)


def check_certificates() -> Iterator[Remark]:
    """Check this computer's certificate for OPC UA, and what cells say of their servers."""
    from robolink.config import load_cells
    from robolink.transport import parse_url

    links = {}
    with suppress(ConfigError):  # another remark is about wrong cell files
        links = {cell.name: parse_url(cell.url) for cell in load_cells().values()}
    links = {name: link for name, link in links.items() if link.medium == "opcua"}
    if not links:
        return
    from robolink.transport.opcua.own_certificate import find_own_certificate
    from robolink.transport.opcua.security import protection_remark

    for name, link in links.items():
        remark = protection_remark(link)
        if remark:
            yield Remark("opcua", Level.WARN, f"{name}: {remark}")
        elif "server_certificate" not in link.options:
            yield Remark(
                "opcua",
                Level.WARN,
                tr("{cell}: nobody has compared the certificate of its server.", cell=name),
                tr('Run: robolink -c "{where}" cell trust', where=name),
            )
    own = find_own_certificate()
    renewal = remedy_word(RemedyWord.RENEW_CERTIFICATE)
    if own is None:
        yield Remark(
            "opcua", Level.OK, tr("this computer has no certificate yet; it is made once.")
        )
    elif own.days_left < 0:
        day = own.ends.date()
        said = tr("this computer's certificate is no longer valid, since {day}.", day=day)
        yield Remark("opcua", Level.BAD, said, tr("Run: {command}", command=renewal))
    elif own.ends_soon:
        said = tr("this computer's certificate ends on {day}.", day=own.ends.date())
        yield Remark("opcua", Level.WARN, said, tr("Run: {command}", command=renewal))
    else:
        yield Remark("opcua", Level.OK, f"{own.public_path} ({own.ends.date()})")


def check_serial_ports() -> Iterator[Remark]:
    """Check that the serial ports may be used."""
    ports = serial_ports()
    for port in ports:
        if port.usable:
            yield Remark("serial", Level.OK, f"{port.device} {port.description}".rstrip())
        else:
            yield Remark(
                "serial",
                Level.WARN,
                tr("you have no permission to use {device}.", device=port.device),
                tr(
                    "Run: sudo usermod -aG {group} $USER, then log in again.",
                    group=port.group or "dialout",
                ),
            )
    if not ports:
        yield Remark("serial", Level.OK, tr("no serial port was found."))


def check_lines_of_cells() -> Iterator[Remark]:
    """Check that the ports that cells name are there."""
    from robolink_cli.commands.computer.lines import devices_of_cells

    known = [port.device for port in serial_ports()]
    for device, names in devices_of_cells().items():
        if not Path(device).exists() and device not in known:
            yield Remark(
                "serial",
                Level.WARN,
                tr("{device} of {cells} was not found.", device=device, cells=", ".join(names)),
                tr("Plug the adapter in; 'robolink cell ports' lists the ports found."),
            )


def check_journal() -> Iterator[Remark]:
    """List the interrupted jobs on any controller, in each journal that the cell files name."""
    from robolink.config import load_cell_files, use_journals_of
    from robolink.journal import default_location
    from robolink.transport import parse_url

    addresses = [""]
    with suppress(ConfigError):  # another remark is about wrong cell files
        files = load_cell_files()
        use_journals_of(files.cells.values(), files.journal)
        addresses += [parse_url(cell.url).address for cell in files.cells.values()]
    for location in dict.fromkeys(map(default_location, addresses)):
        yield from _check_journal_at(location)


def _check_journal_at(location: str) -> Iterator[Remark]:
    from robolink.journal import may_exist, open_journal
    from robolink.model import begun_in_words

    try:
        if not may_exist(location):
            yield Remark("journal", Level.OK, tr("the journal is empty."))
            return
        journal = open_journal(location, read_only=True)
        journal.require_unmoved()
        unsettled = journal.open_markers()
    except ConfigError as error:
        yield Remark("journal", Level.BAD, error.what, error.remedy)
        return
    yield Remark("journal", Level.OK, journal.location)
    for identity, marker in unsettled:
        where = next(iter(journal.addresses_of(identity)), identity)
        yield Remark(
            "unsettled",
            Level.WARN,
            tr(
                "{identity}, since {when}: {request}",
                identity=identity,
                when=local_label(marker.begun_at),
                request=begun_in_words(marker),
            ),
            journal.log(identity).at_work()
            or tr('Run: robolink -c "{where}" recover', where=where),
        )
    if not unsettled:
        yield Remark("unsettled", Level.OK, tr("no job is left unfinished."))


def _others_may(path: Path, bits: int) -> bool:
    # Windows uses access lists instead of these bits.
    return os.name == "posix" and bool(path.stat().st_mode & bits)
