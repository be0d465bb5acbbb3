"""A grammar of wrong command lines, built from the table of commands itself.

Each line is a correct one with one thing wrong in it. The correct parts come from the command's
parameters: which are required, of which type, between which limits. A new command, option or limit
is in the grammar as soon as it exists.
"""

import random
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import click
from robolink_cli import main
from robolink_cli.console.usage_errors import EXAMPLES
from robolink_cli.options.shared import LineType

CELL = "line3"
"""A simulated cell of the cell file in the folder where the lines are typed."""

GIVEN: dict[str, str] = {
    **EXAMPLES,
    "journal export file": "new.csv",
    "sim ctl url": "http://127.0.0.1:1",
    "tool backup file": "new.json",
    "expert recipe check file": "recipe.toml",
    "folder": "new",
}
"""A correct value for each required parameter, by its name, or by the command's and its name."""

CONNECTS: dict[str, list[str]] = {
    "calibrate n-angle": ["--tool", "1", "--points", "901-903", "--yes"],
    "calibrate points": ["--tool", "1", "--points", "901-902", "--yes"],
    "calibrate two-pose": ["--tool", "1", "--yes"],
    "cell tools": [],
    "expert check-contract": [],
    "expert execute-raw": ["--yes", "Print 1"],
    "expert verify-controller": [],
    "recover": ["--yes"],
    "robot io get": ["1"],
    "robot io set": ["1", "on", "--yes"],
    "robot jog": ["z+1", "--yes"],
    "robot motors": ["on", "--yes"],
    "robot reset": ["--yes"],
    "robot variable get": ["g_Long"],
    "robot variable set": ["g_Long", "1", "--type", "Long", "--yes"],
    "robot where": [],
    "status": [],
    "stop": [],
    "tool backup": ["new.json"],
    "tool clear": ["2", "--yes"],
    "tool compare": ["tools.json"],
    "tool get": ["1"],
    "tool impact": ["--tool", "1", "--x", "13", "--points", "1-5"],
    "tool list": [],
    "tool restore": ["tools.json", "--yes"],
    "tool select": ["0", "--yes"],
    "tool set": ["1", "--x", "13", "--yes"],
}
"""The commands that ask a controller, with their required arguments."""

READS: dict[str, str] = {
    "change recipe": "toml",
    "cell check measure": "toml",
    "expert poses show file": "csv",
    "expert solve file": "json",
    "expert spel run files": "prg",
    "expert plc check-map from_csv": "csv",
    "sim epson faults": "toml",
    "sim epson points": "pts",
    "sim epson profile": "json",
    "sim epson program": "prg",
    "sim epson replay": "log",
    "sim epson vision": "toml",
    "sim plc faults": "toml",
    "sim plc map_file": "toml",
    "sim run file": "toml",
    "sim softmotion faults": "toml",
    "tool compare file": "json",
    "tool restore file": "json",
    "calibrate two-pose poses": "csv",
    "calibrate pivot poses": "csv",
    "tool impact pts": "pts",
    "cell accuracy measure study": "toml",
}
"""Parameters that name a file to read, and its contents."""

WRITES: dict[str, str] = {
    "calibrate points report": "html",
    "expert plc export folder": "",
    "expert recipe new file": "toml",
    "expert spel export folder": "",
    "expert verify-controller profile": "json",
    "journal export file": "csv",
    "journal drift page": "html",
    "tool backup file": "json",
    "tool impact report": "html",
}
"""Parameters that name a file to write."""

TOGETHER: list[list[str]] = [
    ["recover", "--keep", "--choose", "old"],
    ["recover", "--forget", "--choose", "old"],
    ["robot io get", "1", "--byte", "1"],
    ["robot io get", "1", "--output", "--memory"],
    ["sim epson", "--tcp", "127.0.0.1:0", "--serial", "pty"],
    ["sim softmotion", "--modbus-tcp", "127.0.0.1:0", "--can", "vcan0"],
    ["expert serve", "--spel", "127.0.0.1:0", "--plc", "n-angle"],
    ["expert serve"],
    ["expert serve", "--plc", "n-angle"],
    ["calibrate two-pose", "--tool", "1", "--points", "901-902", "--pose", "1,2,3"],
    ["calibrate two-pose", "--tool", "1", "--taught-tool", "0"],
    ["calibrate points", "--tool", "1", "--points", "901"],
    ["status", "-c", CELL, "--wait", "-1"],
    ["status", "--log-level", "debug"],
    ["status", "--log-file", "new.log", "--log-level", "loud"],
    ["expert check-contract", "--write"],
    ["expert check-contract", "line4"],
    ["tool set", "1"],
    ["tool impact", "--tool", "1"],
    ["tool impact", "--tool", "1", "--x", "1"],
    ["expert plc check-map", "map.toml", "--from-csv", "missing.csv"],
    ["cell scan"],
    ["journal drift", "--page", "drift.html", "--baseline", "10"],
    ["undo", "--to", "1", "abcd"],
]
"""Options that exclude or require one another; no table of commands has these rules."""

NAMED: list[list[str]] = [
    ["calibrate one-touch", "--tool", "1", "--station", "PIN-99"],
    ["calibrate beams", "--tool", "1", "--station", "PIN-99"],
    ["cell station show", "PIN-99"],
    ["cell people", "line9"],
    ["cell show", "line9"],
    ["cell check", "line9"],
    ["expert recipe new", "scara"],
    ["expert docs", "calibrating"],
    ["journal show", "abcd"],
    ["journal diff", "abcd", "efgh"],
    ["journal report", "abcd"],
    ["undo", "abcd"],
    ["calibrate", "three-pose", "--tool", "1"],
    ["sim epson", "--robot", "T9-999S"],
    ["sim softmotion", "--kinematics", "Kin_Nothing"],
    ["robot jog", "z1"],
    ["robot jog", "q+1"],
    ["robot variable get", "g_None"],
    ["status", "--lang", "fr"],
    ["calibrate beams", "--tool", "1", "--station", "PIN-07", "--beam", "1;2"],
]
"""Names that do not exist."""


@dataclass(frozen=True)
class Wrong:
    """A wrong command line and its fault."""

    kind: str
    command: str
    words: tuple[str, ...]


@dataclass(frozen=True)
class Leaf:
    """A command by its full name."""

    name: str
    command: click.Command

    @property
    def own(self) -> list[click.Parameter]:
        """The parameters other than those that all commands share."""
        shared = {name for one in main.cli.params for name in one.opts}
        return [one for one in self.command.params if not shared.intersection(one.opts)]

    def given(self, parameter: click.Parameter) -> str:
        """A correct value of a required parameter."""
        name = str(parameter.name)
        return GIVEN.get(f"{self.name} {name}", GIVEN.get(name, ""))

    def line(self, *, other: dict[str, str] | None = None, left_out: str = "") -> list[str]:
        """The command with all it requires, with the given values by parameter name."""
        other = other or {}
        options, arguments = [], []
        for one in self.command.params:
            name = str(one.name)
            if name == left_out or not (one.required or name in other):
                continue
            value = other.get(name, self.given(one) if one.required else "")
            if isinstance(one, click.Argument):
                arguments.append(value)
            else:
                options += [max(one.opts, key=len), value]
        if any(value.startswith("-") for value in arguments):
            arguments.insert(0, "--")
        return [*self.name.split(), *options, *arguments]


def leaves(command: click.Command, path: tuple[str, ...] = ()) -> Iterator[Leaf]:
    """Yield every command, including those that the first page leaves out."""
    if not isinstance(command, click.Group):
        yield Leaf(" ".join(path), command)
        return
    context = click.Context(command)
    besides = ["expert"] if command is main.cli else []
    for name in command.list_commands(context) + besides:
        inner = command.get_command(context, name)
        assert inner is not None
        yield from leaves(inner, (*path, name))


def _swapped(word: str, draw: random.Random) -> str:
    """Return a word with two neighbouring letters swapped, or one doubled."""
    places = [n for n in range(1, len(word) - 1) if word[n] != word[n + 1] and word[n] != "-"]
    if not places:
        return f"{word}x"
    n = draw.choice(places)
    return word[:n] + word[n + 1] + word[n] + word[n + 2 :]


Maker = Callable[[Leaf, random.Random], list[str] | None]


def _pick(leaf: Leaf, draw: random.Random, wanted: Callable[[click.Parameter], bool]) -> Any:
    found = [one for one in leaf.own if wanted(one)]
    return draw.choice(found) if found else None


def _with(leaf: Leaf, parameter: click.Parameter | None, value: str) -> list[str] | None:
    return None if parameter is None else leaf.line(other={str(parameter.name): value})


def _is_number(one: click.Parameter) -> bool:
    return isinstance(one.type, (click.types.IntParamType, click.types.FloatParamType)) or (
        one.type.name == "float"
    )


def _misspelt_command(leaf: Leaf, draw: random.Random) -> list[str]:
    line = leaf.line()
    place = draw.randrange(len(leaf.name.split()))
    return [*line[:place], _swapped(line[place], draw), *line[place + 1 :]]


def _misspelt_option(leaf: Leaf, draw: random.Random) -> list[str]:
    names = [max(one.opts, key=len) for one in leaf.own if isinstance(one, click.Option)]
    name = draw.choice(names or ["--json", "--operator"])
    return [*leaf.line(), f"--{_swapped(name[2:], draw)}"]


def _missing(leaf: Leaf, draw: random.Random) -> list[str] | None:
    one = _pick(leaf, draw, lambda one: one.required)
    return None if one is None else leaf.line(left_out=str(one.name))


def _no_value(leaf: Leaf, draw: random.Random) -> list[str] | None:
    one = _pick(leaf, draw, lambda one: isinstance(one, click.Option) and not one.is_flag)
    return None if one is None else [*leaf.line(left_out=str(one.name)), max(one.opts, key=len)]


def _value_of_a_flag(leaf: Leaf, draw: random.Random) -> list[str] | None:
    one = _pick(leaf, draw, lambda one: isinstance(one, click.Option) and one.is_flag)
    return None if one is None else [*leaf.line(), f"{max(one.opts, key=len)}=1"]


def _too_many(leaf: Leaf, draw: random.Random) -> list[str] | None:
    arguments = [one for one in leaf.command.params if isinstance(one, click.Argument)]
    if any(one.nargs == -1 for one in arguments):
        return None
    filled = leaf.line(other={str(one.name): leaf.given(one) or CELL for one in arguments})
    return [*filled, *draw.choice([["now"], ["again", "and", "again"]])]


def _wrong_type(leaf: Leaf, draw: random.Random) -> list[str] | None:
    return _with(leaf, _pick(leaf, draw, _is_number), draw.choice(["soon", "1,5", "0x10", "ten"]))


def _not_finite(leaf: Leaf, draw: random.Random) -> list[str] | None:
    return _with(leaf, _pick(leaf, draw, _is_number), draw.choice(["nan", "inf", "-inf"]))


def _out_of_range(leaf: Leaf, draw: random.Random) -> list[str] | None:
    kinds = (click.IntRange, click.FloatRange)
    one = _pick(leaf, draw, lambda one: isinstance(one.type, kinds))
    if one is None:
        return None
    low, high = one.type.min, one.type.max
    outside = ([] if low is None else [low - 1]) + ([] if high is None else [high + 1])
    return _with(leaf, one, str(draw.choice(outside))) if outside else None


def _no_choice(leaf: Leaf, draw: random.Random) -> list[str] | None:
    one = _pick(leaf, draw, lambda one: isinstance(one.type, click.Choice))
    return None if one is None else _with(leaf, one, _swapped(draw.choice(one.type.choices), draw))


def _no_day(leaf: Leaf, draw: random.Random) -> list[str] | None:
    one = _pick(leaf, draw, lambda one: isinstance(one.type, click.DateTime))
    return _with(leaf, one, draw.choice(["yesterday", "29.11.2026", "2026-13-01"]))


def _empty(leaf: Leaf, draw: random.Random) -> list[str] | None:
    strict = (click.Choice, click.DateTime)
    one = _pick(leaf, draw, lambda one: _is_number(one) or isinstance(one.type, strict))
    return _with(leaf, one, "")


def _chinese(leaf: Leaf, draw: random.Random) -> list[str] | None:
    strict = (click.Choice, click.DateTime)
    one = _pick(leaf, draw, lambda one: _is_number(one) or isinstance(one.type, strict))
    return _with(leaf, one, draw.choice(["工具一", "针尖", "一二三"]))


def _control_characters(leaf: Leaf, draw: random.Random) -> list[str] | None:
    one = _pick(leaf, draw, lambda one: isinstance(one.type, LineType) or _is_number(one))
    return _with(leaf, one, draw.choice(["A\x1b[2J", "1\r\n2", "\x07\x08"]))


def _very_long(leaf: Leaf, draw: random.Random) -> list[str] | None:
    strict = (click.Choice, LineType)
    one = _pick(leaf, draw, lambda one: isinstance(one.type, strict) or _is_number(one))
    return _with(leaf, one, draw.choice("xz7") * 300 + "x")


def _file_to_read(leaf: Leaf, draw: random.Random) -> list[str] | None:
    one = _pick(leaf, draw, lambda one: f"{leaf.name} {one.name}" in READS)
    if one is None:
        return None
    ending = READS[f"{leaf.name} {one.name}"]
    files = [f"missing.{ending}", "folder", "circle", f"garbage.{ending}", f"wrong_key.{ending}"]
    if ending in ("prg", "pts", "log"):
        files.pop()
    return _with(leaf, one, draw.choice(files))


def _file_to_write(leaf: Leaf, draw: random.Random) -> list[str] | None:
    one = _pick(leaf, draw, lambda one: f"{leaf.name} {one.name}" in WRITES)
    if one is None:
        return None
    ending = WRITES[f"{leaf.name} {one.name}"]
    files = ["no/such/folder/new." + ending, "folder", "there." + ending] if ending else ["file"]
    if one.name == "profile":  # written anew each time
        files.pop()
    if leaf.name == "expert recipe new":
        return ["expert", "recipe", "new", "needle-beams", draw.choice(files)]
    at = ["-c", CELL] if leaf.name in CONNECTS else []
    if leaf.name not in CONNECTS:
        return [*at, *leaf.line(other={str(one.name): draw.choice(files)})]
    if isinstance(one, click.Argument):
        return [*at, *leaf.name.split(), draw.choice(files)]
    return [*at, *leaf.name.split(), *CONNECTS[leaf.name], one.opts[-1], draw.choice(files)]


_TOOLS = ("number", "tool", "taught_tool", "then_select", "tip")


def _no_such_tool(leaf: Leaf, draw: random.Random) -> list[str] | None:
    one = _pick(leaf, draw, lambda one: one.name in _TOOLS and _is_number(one))
    if one is None or leaf.name not in CONNECTS:
        return None
    zero = one.name in ("number", "tool", "tip") and leaf.name not in ("tool get", "tool select")
    value = "0" if zero else draw.choice(["99", "16"])
    rest = [word for word in CONNECTS[leaf.name] if word not in ("--tool",)]
    if isinstance(one, click.Argument):
        return ["-c", CELL, *leaf.name.split(), value, *rest[1:]]
    return ["-c", CELL, *leaf.name.split(), *CONNECTS[leaf.name], one.opts[-1], value]


CONTROLLERS = {
    "a cell that does not exist": ["-c", "line33"],
    "an unknown kind of controller": ["-c", "epsn+tcp://192.168.0.1:5000"],
    "an unknown way to it": ["-c", "epson+tpc://192.168.0.1:5000"],
    "a port that is none": ["-c", "epson+tcp://192.168.0.1:70000"],
    "a URL without an address": ["-c", "epson+tcp://"],
    "an unknown key in a URL": ["-c", "epson+sim://other?sped=1"],
    "a password in a URL": ["-c", "epson+tcp://user:pass@192.168.0.1:5000"],
    "nobody listens there": ["-c", "epson+tcp://127.0.0.1:PORT"],
    "nobody listens at the PLC": ["-c", "softmotion+modbus-tcp://127.0.0.1:PORT"],
    "a wrong password": ["-c", "locked", "--password-file", "wrong"],
    "no password": ["-c", "locked"],
    "a password file that is missing": ["-c", "locked", "--password-file", "missing"],
    "a password file that others read": ["-c", "locked", "--password-file", "open"],
    "no controller named": [],
    "a map that is missing": ["-c", "plc+sim://m?map=missing.toml"],
    "a serial port that is missing": ["-c", "epson+serial:///dev/ttyNONE"],
}
"""Faults of a command's controller."""


def _of_a_list(lines: list[list[str]]) -> Maker:
    def made(leaf: Leaf, draw: random.Random) -> list[str] | None:
        of_it = [[*line[0].split(), *line[1:]] for line in lines if line[0] == leaf.name]
        if not of_it:
            return None
        line = draw.choice(of_it)
        asks = any("-c" in one.opts for one in leaf.command.params)
        return ["-c", CELL, *line] if asks and "-c" not in line else line

    return made


KINDS: dict[str, tuple[float, Maker]] = {
    "misspelt command": (0.2, _misspelt_command),
    "misspelt option": (0.25, _misspelt_option),
    "something is missing": (1, _missing),
    "an option without its value": (0.5, _no_value),
    "a value of a flag": (0.3, _value_of_a_flag),
    "too many words": (0.4, _too_many),
    "no number": (0.5, _wrong_type),
    "not finite": (0.5, _not_finite),
    "out of range": (0.7, _out_of_range),
    "none of the choices": (1, _no_choice),
    "no day": (12, _no_day),
    "empty": (0.5, _empty),
    "Chinese": (0.3, _chinese),
    "control characters": (0.3, _control_characters),
    "very long": (0.3, _very_long),
    "a file to read": (5, _file_to_read),
    "a file to write": (5, _file_to_write),
    "no such tool": (3, _no_such_tool),
    "options that do not go together": (6, _of_a_list(TOGETHER)),
    "a name that nothing has": (6, _of_a_list(NAMED)),
}
"""Kinds of faults and their weights: larger where few commands can have the fault."""


def wrong_commands(seed: int) -> list[Wrong]:
    """Draw wrong command lines: two for every command, two more if it asks a controller.

    Each command is drawn by itself, so that a new option changes only its own command's lines.
    """
    drawn: list[Wrong] = []
    for leaf in leaves(main.cli):
        draw = random.Random(f"{seed} {leaf.name}")
        kinds = list(KINDS)
        own: list[Wrong] = []
        while len(own) < _OF_EACH and kinds:
            (kind,) = draw.choices(kinds, [KINDS[one][0] for one in kinds])
            kinds.remove(kind)
            words = KINDS[kind][1](leaf, draw)
            if words is not None:
                own.append(Wrong(kind, leaf.name, tuple(words)))
        drawn += own
    ways = list(CONTROLLERS)
    for n, name in enumerate(CONNECTS):
        for kind in (ways[2 * n % len(ways)], ways[(2 * n + 1) % len(ways)]):
            drawn.append(Wrong(kind, name, (*CONTROLLERS[kind], *name.split(), *CONNECTS[name])))
    return drawn


_OF_EACH = 2
