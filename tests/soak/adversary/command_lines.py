"""Lines that an operator may type: each command that acts on a controller, with random options.

The commands and their options come from the program itself, with the limits that their types
declare. Tables hold only words whose meaning no type declares (steps of a jog, names, files), and
the commands left out, with reasons.
"""

import random
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise
from typing import Final

import click
from robolink_cli.main import cli

from robolink.model import ToolOffset

_UNITS: Final = {
    "--x": "x_mm",
    "--y": "y_mm",
    "--z": "z_mm",
    "--u": "u_deg",
    "--v": "v_deg",
    "--w": "w_deg",
}

STOP: Final = ("stop",)
"""The line that stops a machine, whatever is moving it."""


def is_stop(line: Sequence[str]) -> bool:
    """Return whether a line stops the machine instead of showing its requests."""
    return tuple(line[:1]) == STOP and "--dry-run" not in line


def typed_components(line: Sequence[str]) -> tuple[int, dict[str, float]] | None:
    """Return the tool that a line writes and the components that it names; ``None`` for none."""
    if tuple(line[:2]) != ("tool", "set") or "--dry-run" in line or not line[2].isdigit():
        return None
    named = {_UNITS[one]: float(value) for one, value in pairwise(line) if one in _UNITS}
    return int(line[2]), named


def cleared(line: Sequence[str]) -> int | None:
    """Return the tool that a line clears; ``None`` for none."""
    clears = tuple(line[:2]) == ("tool", "clear") and "--dry-run" not in line
    return int(line[2]) if clears else None


def selects(line: Sequence[str]) -> bool:
    """Whether a line may leave another tool selected on purpose."""
    if line[:2] == ("tool", "select"):
        return True
    return "--then-select" in line or "--selected" in line


def offset_of(held: ToolOffset | None, named: Mapping[str, float]) -> ToolOffset:
    """Return a tool's expected value after some of its components are typed."""
    return replace(held if held is not None else ToolOffset(), **named)


ASSIST: Final = "{assist}"
FOLDER: Final = "{folder}"
"""The placeholder in a line for the folder, known when it is typed."""

LEFT_OUT: Final[Mapping[str, str]] = {
    "sim": "it serves simulators until it is ended",
    "expert demo": "it brings a controller of its own",
    "panel": "it serves pages until it is ended; its jobs are these command lines",
    "panel pin": "it is about the people of this computer alone",
    "panel tablets": "it is about the tablets of this computer alone",
    "panel cert": "it writes a file of this computer alone",
    "cell list": "it reads files of this computer alone",
    "cell show": "it reads files of this computer alone",
    "cell check": "it looks at the cells of this computer's files",
    "cell files": "it reads files of this computer alone",
    "cell validate": "it reads files of this computer alone",
    "cell doctor": "it looks at this computer",
    "cell scan": "it looks for controllers on a network",
    "cell ports": "it looks at the ports of this computer",
    "cell people": "it reads files of this computer alone",
    "cell fleet": "it is about the plans of a plant; tests/fleet kills its agent",
    "journal move": "it moves the record that the rules read; its tests kill it at each step",
    "journal sync": "it copies to a plant, of which these cells know none",
    "expert serve": "it serves until it is ended; cells whose program calls back have it",
    "expert spel run": "it brings a controller of its own",
}
"""Commands, or groups of them, that are not drawn, with reasons."""

_NOT_DRAWN: Final = frozenset(
    {
        *("--password-file", "--timeout", "--remote-timeout", "--operator", "--record"),
        *("-c", "--json", "--lang", "--keys", "--plain", "--help"),
        *("--driver", "named", "--write", "--move"),
    }
)
"""Options of the link and the terminal, which all commands share, and options that name a module.

The checks of the contract that write or move open markers on purpose, in a record in memory, which
the rules cannot read (``tests/cli/test_check_contract.py``).
"""

_EXPERT: Final = "expert"
"""The group for integrators and engineers, which no help page lists."""

_FILES: Final = (f"{FOLDER}/kept.json", f"{FOLDER}/other.json")
_TOOLS: Final = ("1", "2", "2", "3", "3", "4", "0", "16")
_WORDS: Final[Mapping[str, tuple[str, ...]]] = {
    "steps": ("z+0.5", "z+2", "x+0.3", "y-0.3", "u+2", "z+9", "a"),
    "name": ("g_lot", "pin", "last"),
    "value": ("1", "2.5", "on", "a"),
    "file": _FILES,
    "files": _FILES,
    "path": _FILES,
    "folder": (f"{FOLDER}/companions",),
    "page": ("stopping", "tutorial", "zzzz"),
    "statement": ("Print CZ(Here)", "Print TLSet(2)", "Print Tool", "Weight 2", "Print"),
    "number": _TOOLS,
    "change": ("zzzz", "1"),
    "recipe": (f"{FOLDER}/recipe.toml",),
    "a": ("1", "2"),
    "b": ("2", "3"),
    "--tool": _TOOLS,
    "--station": ("pin",),
    "--assist": (ASSIST,),
    "--points": ("1-2", "1,2,3"),
    "--take-over": ("the other one is at lunch",),
    "--x": ("5.125", "6.123456789", "-2.5"),
    "--y": ("1.25", "-3.140625", "0"),
    "--z": ("-10.5", "-20.000488", "12"),
    "--u": ("0", "15.5"),
    "--v": ("0", "1"),
    "--w": ("0",),
}
"""Words for a named parameter; other parameters use their types."""

_OFTEN: Final[Mapping[str, float]] = {
    "--yes": 0.85,
    "--assist": 0.9,
    "--x": 0.7,
    "--y": 0.5,
    "--z": 0.5,
    "--u": 0.1,
    "--v": 0.05,
    "--w": 0.05,
    "--then-select": 0.5,
    "--dry-run": 0.12,
    "steps": 1.0,
    "number": 0.95,
    "bit": 0.9,
    "--tool": 0.3,
    "--published": 0.1,
}
_SELDOM: Final = 0.08
"""The share of lines with an option that is not required, for a command with a dozen of them; with
more, each is rarer.
"""

_WEIGHTS: Final[Mapping[str, float]] = {
    "tool set": 10.0,
    "tool select": 5.0,
    "tool clear": 4.0,
    "tool backup": 3.0,
    "tool restore": 4.0,
    "undo": 4.0,
    "recover": 4.0,
    "robot jog": 5.0,
    "calibrate two-pose": 5.0,
    "calibrate n-angle": 2.0,
    "stop": 4.0,
    "expert check-contract": 2.0,
    "expert verify-controller": 2.0,
    "expert execute-raw": 2.0,
}

_USUAL: Final[Mapping[str, float]] = {_EXPERT: 0.5}
"""Weights of the other commands in a group; those for integrators mostly act on files alone."""


@dataclass(frozen=True, slots=True)
class DrawnCommand:
    """A command of the program.

    Attributes:
        path: Its name, with those of the groups before it.
        command: The click command.
    """

    path: tuple[str, ...]
    command: click.Command

    @property
    def name(self) -> str:
        """The full name."""
        return " ".join(self.path)


def every_command() -> Iterator[DrawnCommand]:
    """Yield each listed command of the program, and those for integrators."""
    root = click.Context(cli, info_name="robolink")
    yield from _below(cli, (), root)
    expert = cli.get_command(root, _EXPERT)
    assert expert is not None  # it stands in the map
    yield from _below(expert, (_EXPERT,), click.Context(expert, parent=root, info_name=_EXPERT))


@cache
def drawn_commands() -> tuple[DrawnCommand, ...]:
    """Return the commands from which lines are drawn."""
    return tuple(one for one in every_command() if not left_out(one))


def left_out(one: DrawnCommand) -> str:
    """Return why a command is not drawn; empty if it is."""
    return next(
        (why for name, why in LEFT_OUT.items() if f"{one.name} ".startswith(f"{name} ")), ""
    )


def drawn_line(rng: random.Random) -> tuple[str, ...]:
    """Return a random line for a command."""
    commands = drawn_commands()
    weights = [_WEIGHTS.get(one.name, _USUAL.get(one.path[0], 1.0)) for one in commands]
    chosen = rng.choices(commands, weights)[0]
    seldom = _SELDOM / max(1, len(chosen.command.params) / 12)
    options: list[str] = []
    arguments: list[str] = []
    for parameter in chosen.command.params:
        name = parameter.opts[0]
        long = max(parameter.opts, key=len)
        if long in _NOT_DRAWN or name in _NOT_DRAWN:
            continue
        often = 1.0 if parameter.required else _OFTEN.get(long, seldom)
        if rng.random() >= often:
            continue
        if getattr(parameter, "is_flag", False):
            options.append(long)
        elif isinstance(parameter, click.Argument):
            arguments.append(_value(parameter, name, rng))
        else:
            options += [long, _value(parameter, long, rng)]
    return (*chosen.path, *arguments, *options)


def _below(
    command: click.Command, path: tuple[str, ...], context: click.Context
) -> Iterator[DrawnCommand]:
    if not isinstance(command, click.Group):
        yield DrawnCommand(path, command)
        return
    for name in command.list_commands(context):
        below = command.get_command(context, name)
        if below is not None:
            inside = click.Context(below, parent=context, info_name=name)
            yield from _below(below, (*path, name), inside)


def _value(parameter: click.Parameter, name: str, rng: random.Random) -> str:
    if name in _WORDS:
        return rng.choice(_WORDS[name])
    kind = parameter.type
    if isinstance(kind, click.Choice):
        return str(rng.choice(list(kind.choices)))
    default = parameter.default if isinstance(parameter.default, (int, float)) else 3
    low = getattr(kind, "min", None)
    high = getattr(kind, "max", None)
    first = low if low is not None else default / 2
    last = min(high if high is not None else default * 2, first + max(abs(default), 8))
    if isinstance(kind, (click.IntRange, type(click.INT))):
        return str(rng.randint(round(first), max(round(first), round(last))))
    if isinstance(kind, (click.FloatRange, type(click.FLOAT))):
        return f"{rng.uniform(first, last):.4g}"
    if isinstance(kind, click.Path):
        return rng.choice(_FILES)
    return rng.choice(("90", "0,120,240", "2026-01-05"))
