"""var get, set: the project's Global Preserve variables."""

from typing import TYPE_CHECKING, Annotated

import click

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink_cli.console.render import emit, say, show_requests
from robolink_cli.options.consent import DryRun, Yes
from robolink_cli.options.declaration import CliArgument, CliOption
from robolink_cli.prompts.questions import agree
from robolink_cli.session.connection import open_controller
from robolink_cli.session.context import CliContext, controller_options

if TYPE_CHECKING:
    from robolink.controllers import EpsonVariables
    from robolink.model import Controller

_TYPES = ("Boolean", "Byte", "Double", "Integer", "Long", "Real", "String")


def variables_of(controller: "Controller") -> "EpsonVariables":
    """Return the project's variables; only EPSON controllers have them."""
    from robolink_cli.access.capabilities import require_epson

    return require_epson(controller, tr("project variables")).variables


@click.group()
def var() -> None:
    """Read and set variables that the project declares Global Preserve."""


@var.command("get")
@controller_options
def get(
    context: CliContext,
    *,
    name: Annotated[str, CliArgument()],
    kind: Annotated[
        str | None,
        click.Choice(_TYPES, case_sensitive=False),
        CliOption("--type", help="Its declared type."),
    ] = None,
    index: Annotated[
        str | None,
        CliOption(metavar="I,J,K", help="Subscripts of an array's element; needs --type."),
    ] = None,
    count: Annotated[
        int | None,
        click.IntRange(1, 100),
        CliOption(help="How many elements, from --index on; the last subscript counts up."),
    ] = None,
) -> None:
    """Show a variable. Allowed while production runs."""
    subscripts = _subscripts(index)
    if (subscripts and kind is None) or (count is not None and not subscripts):
        raise ConfigError(
            tr("An array's elements need --type and --index."),
            remedy=tr(
                "Write for example 'robolink robot variable get g_table --type Real --index 0,0'."
            ),
        )
    with open_controller(context) as controller:
        value = _read(controller, name, kind, subscripts, count=count)
    payload: dict[str, object] = {"name": name, "type": kind, "value": value}
    if subscripts:
        payload["index"] = list(subscripts)
    line = ", ".join(str(item) for item in value) if isinstance(value, list) else value
    emit("variable", payload, lambda: say(f"{name} = {line}"))


# A negative value is not an option.
@var.command(
    "set",
    context_settings={"ignore_unknown_options": True},
    short_help="Set a variable and read it back.",
)
@controller_options
def set_variable(
    context: CliContext,
    *,
    name: Annotated[str, CliArgument()],
    value: Annotated[str, CliArgument()],
    kind: Annotated[
        str,
        click.Choice(_TYPES, case_sensitive=False),
        CliOption("--type", help="Its declared type."),
    ],
    dry_run: DryRun = False,
    yes: Yes = False,
) -> None:
    """Set a variable and read it back; the program that uses it may act on it."""
    from robolink.controllers import typed_value

    wanted = typed_value(value, kind)
    with open_controller(context) as controller:
        if dry_run:
            show_requests(variables_of(controller).preview_write(name, wanted, kind))
            return
        agree(tr("Set {name} to {value}?", name=name, value=wanted), yes=yes)
        receipt = variables_of(controller).write(name, wanted, kind)
    payload: dict[str, object] = {
        "name": name,
        "type": kind,
        "before": receipt.before,
        "value": receipt.read_back,
        "skipped": receipt.skipped,
    }
    done = tr("no change needed") if receipt.skipped else tr("set, read back")
    line = tr("{name} = {value}: {done}", name=name, value=receipt.read_back, done=done)
    emit("variable-set", payload, lambda: say(line))


def _read(
    controller: "Controller",
    name: str,
    kind: str | None,
    subscripts: tuple[int, ...],
    *,
    count: int | None,
) -> object:
    if kind is None:
        return variables_of(controller).text(name)
    if subscripts:
        return list(variables_of(controller).read_array(name, subscripts, kind, count=count or 1))
    return variables_of(controller).read(name, kind)


def _subscripts(text: str | None) -> tuple[int, ...]:
    if text is None:
        return ()
    parts = text.split(",")
    if not all(part.isascii() and part.isdigit() for part in parts):
        raise ConfigError(
            tr("{text!r} are not subscripts.", text=text),
            remedy=tr("Write for example --index 0,3."),
        )
    return tuple(int(part) for part in parts)
