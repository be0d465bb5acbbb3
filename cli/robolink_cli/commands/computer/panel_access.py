"""panel pin, tablets, cert: who may command from pages, on what, and how tablets know the panel."""

import socket
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import click

from robolink.errors import ConfigError, DeclinedError
from robolink.files.named import OthersMayReadError, read_named
from robolink.messages import known_names, tr
from robolink.model import Secret
from robolink.timing import local_label
from robolink_cli.commands.computer.panel import require_packages
from robolink_cli.console.person import Person, person_here
from robolink_cli.console.render import emit, json_is_on, say
from robolink_cli.options.declaration import CliArgument, CliOption
from robolink_cli.options.shared import json_option

_MOST_BYTES = 1000


@click.command()
@json_option
def pin(
    *,
    name: Annotated[str | None, CliArgument()] = None,
    pin_file: Annotated[
        Path | None,
        CliOption(help="Take the PIN from the first line of a file that only you can read."),
    ] = None,
    remove: Annotated[bool, CliOption(help="Remove the PIN.")] = False,
) -> None:
    """Set the PIN of a person, by the NAME in the cell file; it is typed unseen.

    Moving and writing from a page take a PIN. Without NAME it is that of this computer, for cells
    that name no people. A new PIN ends what was logged in with the old one.
    """
    from robolink_cli.panel.guard.people import NOBODY, Pins

    who = NOBODY if name is None else _known(name, remove=remove)
    if remove:
        removed = Pins().remove(who)
        sentence = tr("The PIN was removed.") if removed else tr("There was no PIN.")
    else:
        Pins().set(who, _typed(pin_file))
        sentence = tr("The PIN was set. It counts at once, also on a panel that runs.")
    emit("panel-pin", {"name": name, "set": not remove}, lambda: say(sentence))


@click.command()
@json_option
def tablets(
    *,
    forget: Annotated[
        str | None,
        CliOption(metavar="ID", help="Undo the pairing of this tablet: lost, sold, or not yours."),
    ] = None,
) -> None:
    """List the tablets that are paired with this computer. From them the robot can be stopped."""
    from robolink_cli.panel.guard.pairing import PairedTablets

    paired = PairedTablets()
    if forget is not None:
        paired.forget(forget)
    found = list(paired.all())
    payload = {"tablets": [asdict(tablet) for tablet in found]}

    def show() -> None:
        if not found:
            say(tr("No tablet is paired."))
        for tablet in found:
            by = tablet.by or tr("the panel's own PIN")
            say(f"{tablet.id}  {local_label(tablet.at)}  {tablet.address}  {by}")

    emit("panel-tablets", payload, show)


@click.command()
@json_option
def cert(
    *,
    name: Annotated[
        tuple[str, ...],
        CliOption(
            metavar="NAME",
            help="A name or address by which tablets open the panel; by default this computer's "
            "own. May be repeated.",
        ),
    ] = (),
    replace: Annotated[bool, CliOption(help="Replace the certificate that there is.")] = False,
    show: Annotated[bool, CliOption(help="Show the one that there is, and make none.")] = False,
) -> None:
    """Make a certificate, with which the panel can be opened from other computers.

    Compare its fingerprint with what a tablet shows when it opens the panel for the first time. A
    shop with a CA of its own gives --tls-cert and --tls-key to 'robolink panel' instead.
    """
    require_packages(("cryptography",))
    from robolink_cli.panel.guard import tls

    path, key = tls.own_files()
    if show and not path.exists():
        raise ConfigError(tr("There is no certificate yet."), remedy=tr("Run: robolink panel cert"))
    made = tls.load(path, key) if show else tls.make(name or _own_names(), replace=replace)
    ends = made.ends.date().isoformat()
    payload = {
        "path": str(made.path),
        "names": list(made.names),
        "fingerprint_sha256": made.fingerprint,
        "valid_until": ends,
    }

    def tell() -> None:
        say(tr("Certificate: {path}", path=made.path))
        say(tr("For: {names}", names=", ".join(made.names)))
        say(tr("Until: {day}", day=ends))
        say(tr("SHA-256 fingerprint: {fingerprint}", fingerprint=made.fingerprint))

    emit("panel-cert", payload, tell)


def _known(name: str, *, remove: bool) -> str:
    """Return a name of the cell files.

    Raises:
        ConfigError: No cell names this person.
    """
    from robolink.config import load_cells

    people = {
        person: None for cell in load_cells().values() for person in cell.settings.people or ()
    }
    if name not in people and not remove:
        raise ConfigError(
            tr("No cell has {name} among its people.", name=name),
            remedy=known_names(people, name)
            if people
            else tr(
                "The cell files name no people: leave NAME out, or add 'people' to the cell file."
            ),
        )
    return name


def _typed(file: Path | None) -> Secret:
    """Return the PIN of a file, or as a person types it.

    Raises:
        ConfigError: The file cannot be read, or the two that were typed differ.
        DeclinedError: There is nobody to ask.
    """
    if file is not None:
        return _of_file(file)
    if json_is_on() or person_here() is not Person.TERMINAL:
        raise DeclinedError(
            tr("A PIN is typed at a terminal, and there is none."),
            remedy=tr("Give --pin-file FILE. A PIN never stands on a command line."),
        )
    typed = str(click.prompt(tr("PIN, 6 to 12 digits"), hide_input=True, err=True))
    again = str(click.prompt(tr("Once more"), hide_input=True, err=True))
    if typed != again:
        raise ConfigError(tr("The two PINs are not the same."), remedy=tr("The PIN was not set."))
    return Secret(typed)


def _of_file(file: Path) -> Secret:
    try:
        lines = read_named(file, most_bytes=_MOST_BYTES, secret=True).splitlines()
        return Secret(lines[0].decode("ascii").strip() if lines else "")
    except OthersMayReadError as error:
        raise ConfigError(
            tr("Others than its owner can read {path}.", path=file),
            remedy=tr("Run: chmod 600 {path}", path=file),
        ) from error
    except UnicodeError:
        return Secret("")  # no PIN, which the store says
    except OSError as error:
        raise ConfigError(
            tr("{path} cannot be read: {cause}.", path=file, cause=error.strerror or error),
            remedy=tr("The PIN was not set."),
        ) from error


def _own_names() -> tuple[str, ...]:
    """Return this computer's names and addresses, as far as it knows them."""
    here = socket.gethostname()
    found = dict.fromkeys((here, "localhost", "127.0.0.1", "::1"))
    try:
        answers = socket.getaddrinfo(here, None, type=socket.SOCK_STREAM)
    except OSError:
        answers = []
    found |= dict.fromkeys(str(answer[4][0]).partition("%")[0] for answer in answers)
    return tuple(found)
