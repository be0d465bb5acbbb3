"""io get, set: inputs, outputs and memory bits."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Annotated, Literal

import click

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink_cli.access.capabilities import io_of, require_epson
from robolink_cli.console.render import emit, say, show_requests
from robolink_cli.console.shell_words import io_words
from robolink_cli.options.consent import DryRun, Yes
from robolink_cli.options.declaration import CliArgument, CliOption
from robolink_cli.prompts.questions import agree
from robolink_cli.session.connection import open_controller
from robolink_cli.session.context import CliContext, controller_options

if TYPE_CHECKING:
    from robolink.model import Controller, ValueReceipt

_number = click.IntRange(min=0, max=0xFFFF)
_Memory = Annotated[bool, CliOption(help="Memory bits instead of inputs or outputs.")]


@click.group()
def io() -> None:
    """Read inputs, switch outputs, read and switch memory bits."""


@io.command("get")
@controller_options
def get(
    context: CliContext,
    *,
    bit: Annotated[int | None, _number, CliArgument()] = None,
    byte: Annotated[
        int | None, _number, CliOption(metavar="PORT", help="Eight bits, from 8 x PORT on.")
    ] = None,
    word: Annotated[
        int | None, _number, CliOption(metavar="PORT", help="Sixteen bits, from 16 x PORT on.")
    ] = None,
    output: Annotated[bool, CliOption(help="An output, read through Execute.")] = False,
    memory: _Memory = False,
) -> None:
    """Show an input. Allowed while production runs, except with --output."""
    if sum(at is not None for at in (bit, byte, word)) != 1:
        raise ConfigError(
            tr("Only one place can be read at a time."),
            remedy=tr("Give one of BIT, --byte PORT and --word PORT."),
        )
    if output and (memory or bit is None):
        raise ConfigError(
            tr("Outputs are read bit by bit, and are not memory."),
            remedy=tr("Write for example 'robolink robot io get 3 --output'."),
        )
    with open_controller(context) as controller:
        if bit is not None and not (output or memory):
            value: int = io_of(controller).read_input(bit)
        else:
            bank = require_epson(controller, tr("outputs, memory, bytes or words to read")).io
            if bit is not None:
                value = (bank.read_output if output else bank.read_memory)(bit)
            elif byte is not None:
                value = (bank.read_memory_byte if memory else bank.read_input_byte)(byte)
            else:
                value = (bank.read_memory_word if memory else bank.read_input_word)(word or 0)
    size = "bit" if bit is not None else "byte" if byte is not None else "word"
    at = next(number for number in (bit, byte, word) if number is not None)
    kind = "output" if output else "memory" if memory else "input"
    payload: dict[str, object] = {"kind": kind, "size": size, "number": at, "value": value}
    emit("io", payload, lambda: say(_shown(kind, size, at, value)))


@io.command("set")
@controller_options
def set_bit(
    context: CliContext,
    *,
    bit: Annotated[int, _number, CliArgument()],
    switch: Annotated[Literal["on", "off"], CliArgument()],
    memory: _Memory = False,
    dry_run: DryRun = False,
    yes: Yes = False,
) -> None:
    """Switch an output or a memory bit, and read it back. An output may move something."""
    on = switch == "on"
    kind = io_words("memory" if memory else "output")
    with open_controller(context) as controller:
        preview, change = _switching(controller, memory=memory)
        if dry_run:
            show_requests(preview(bit, on))
            return
        agree(tr("Switch {kind} {bit} {switch}?", kind=kind, bit=bit, switch=switch), yes=yes)
        receipt = change(bit, on)
    payload: dict[str, object] = {
        "kind": "memory" if memory else "output",
        "number": bit,
        "before": None if receipt is None else receipt.before,
        "value": None if receipt is None else receipt.read_back,
        "skipped": receipt is not None and receipt.skipped,
    }
    if payload["skipped"]:
        done = tr("no change needed")
    elif payload["value"] is None:
        done = tr("switched, acknowledged; it cannot be read back")
    else:
        done = tr("switched, read back")
    line = tr("{kind} {bit} {switch}: {done}", kind=kind, bit=bit, switch=switch, done=done)
    emit("io-set", payload, lambda: say(line))


def _switching(
    controller: "Controller", *, memory: bool
) -> (
    "tuple[Callable[[int, bool], Sequence[str]], Callable[[int, bool], ValueReceipt[bool] | None]]"
):
    """Return what shows the requests of switching a bit, and what switches it."""
    if memory:
        bank = require_epson(controller, tr("memory bits")).io
        return bank.preview_memory, bank.set_memory
    outputs = io_of(controller)
    return outputs.preview_output, outputs.set_output


def _shown(kind: str, size: str, at: int, value: int) -> str:
    if size == "bit":
        state = tr("on") if value else tr("off")
        return tr("{kind} {at}: {state}", kind=io_words(kind), at=at, state=state)
    width = 8 if size == "byte" else 16
    return tr(
        "{kind} {size} {at}: {value} (bits {high} to {low}: {bits})",
        kind=io_words(kind),
        size=tr("byte") if size == "byte" else tr("word"),
        at=at,
        value=value,
        high=at * width + width - 1,
        low=at * width,
        bits=f"{value:0{width}b}",
    )
