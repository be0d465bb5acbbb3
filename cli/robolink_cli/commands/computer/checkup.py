"""The checks of ``doctor``: this computer, never a controller."""

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path

from robolink.errors import ConfigError
from robolink.files.durable import state_folder
from robolink.messages import spoken, tr
from robolink.timing import local_label
from robolink_cli.commands.computer.doctor_finding import Level, Remark, guarded
from robolink_cli.commands.computer.requirements import check_name, check_versions
from robolink_cli.commands.computer.serial_ports import serial_ports
from robolink_cli.console.columns import padded


def check_up() -> list[Remark]:
    """Return everything that was looked at, what is worst first."""
    looks: dict[str, Callable[[], Iterable[Remark]]] = {
        "packages": check_versions,
        "name": check_name,
        "state": check_state_folder,
        "cells": check_cell_files,
        "keyring": check_keyring,
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
        yield tr("Something is wrong; see the first lines.")
    else:
        yield tr("No problem was found.")


def check_state_folder() -> Iterator[Remark]:
    """See whether backups can be kept; without one nothing is ever written."""
    folder = state_folder("backups")
    # On Windows not even the drive need be there.
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
                tr("anybody may change {path}, and with it where commands go.", path=path),
                tr("Run: chmod o-w {path}", path=path),
            )
        else:
            yield Remark("cells", Level.OK, str(path))
    if files:
        yield Remark("cells", Level.OK, tr("cells: {names}.", names=", ".join(cell_names())))
    else:
        yield Remark("cells", Level.OK, tr("there is no cell file; -c takes a URL."))


def check_keyring() -> Iterator[Remark]:
    """See whether passwords can be kept in the system's keyring."""
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


def check_serial_ports() -> Iterator[Remark]:
    """See whether the serial ports may be used."""
    ports = serial_ports()
    for port in ports:
        if port.usable:
            yield Remark("serial", Level.OK, f"{port.device} {port.description}".rstrip())
        else:
            yield Remark(
                "serial",
                Level.WARN,
                tr("you may not use {device}.", device=port.device),
                tr(
                    "Run: sudo usermod -aG {group} $USER, then log in again.",
                    group=port.group or "dialout",
                ),
            )
    if not ports:
        yield Remark("serial", Level.OK, tr("there is no serial port."))


def check_lines_of_cells() -> Iterator[Remark]:
    """See whether the ports that cells name are there."""
    from robolink_cli.commands.computer.lines import devices_of_cells

    known = [port.device for port in serial_ports()]
    for device, names in devices_of_cells().items():
        if not Path(device).exists() and device not in known:
            yield Remark(
                "serial",
                Level.WARN,
                tr("{device} of {cells} is not there.", device=device, cells=", ".join(names)),
                tr("Plug the adapter in; 'robolink cell ports' lists those that are there."),
            )


def check_journal() -> Iterator[Remark]:
    """List what was begun on any controller and is not proved finished."""
    from robolink.journal import default_location, may_exist, open_journal
    from robolink.model import begun_in_words

    try:
        if not may_exist(default_location()):
            yield Remark("journal", Level.OK, tr("nothing was recorded yet."))
            return
        journal = open_journal(read_only=True)
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
        yield Remark("unsettled", Level.OK, tr("nothing was left unfinished."))


def _others_may(path: Path, bits: int) -> bool:
    # Windows keeps access in lists, not in these bits.
    return os.name == "posix" and bool(path.stat().st_mode & bits)
