"""var get, set: the project's Global Preserve variables."""

from typing import TYPE_CHECKING

import click

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink_cli.console.render import say
from robolink_cli.options.consent import dry_run_option, yes_option
from robolink_cli.prompts.questions import agree
from robolink_cli.session.context import CliContext, controller_options
from robolink_cli.session.opening import open_controller

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
@click.argument("name")
@click.option(
    "--type", "kind", type=click.Choice(_TYPES, case_sensitive=False), help="Its declared type."
)
@click.option("--index", metavar="I,J,K", help="Subscripts of an array's element; needs --type.")
@click.option(
    "--count",
    type=click.IntRange(1, 100),
    metavar="N",
    help="How many elements, from --index on; the last subscript counts up.",
)
@controller_options
def get(
    context: CliContext, name: str, kind: str | None, index: str | None, count: int | None
) -> None:
    """Show a variable. Legal while production runs."""
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
    context.emit("variable", payload, lambda: say(f"{name} = {line}"))


# A negative value is no option.
@var.command(
    "set",
    context_settings={"ignore_unknown_options": True},
    short_help="Set a variable and read it back.",
)
@click.argument("name")
@click.argument("value")
@click.option(
    "--type",
    "kind",
    type=click.Choice(_TYPES, case_sensitive=False),
    required=True,
    help="Its declared type.",
)
@controller_options
@dry_run_option
@yes_option
def set_variable(
    context: CliContext, name: str, value: str, kind: str, *, dry_run: bool, yes: bool
) -> None:
    """Set a variable and read it back; the program that uses it may act on it."""
    from robolink.controllers import typed_value

    wanted = typed_value(value, kind)
    with open_controller(context) as controller:
        if dry_run:
            context.show_requests(variables_of(controller).preview_write(name, wanted, kind))
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
    done = tr("was so already") if receipt.skipped else tr("set, read back")
    line = tr("{name} = {value}: {done}", name=name, value=receipt.read_back, done=done)
    context.emit("variable-set", payload, lambda: say(line))


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
