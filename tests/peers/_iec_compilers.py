"""MATIEC and STruC++, if installed: they make a program of the mailbox's core.

The program reads the pins of one call as numbers from its standard input, executes a block of the
core, and writes the pins to its standard output: that of the interpreter's own memory, so that
the compiled block can take the place of the interpreted one.
"""

import os
import shutil
import subprocess
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from robolink_simulators.structured_text import SourceText, StructuredProgram
from robolink_simulators.structured_text.data_types import (
    ArrayType,
    BlockType,
    DataType,
    Frame,
    ScalarType,
    StructType,
)

BLOCKS: Final = ("RL_MailboxCore", "RL_SlotTable")
"""The blocks of the core that the exported program calls."""

_KINDS: Final = ("var_input", "var_output", "var_in_out")
_HOLDER: Final = "holder"
"""A variable inside the core that the simulated PLC reads."""
_MAIN: Final = "RL_Bench"
_CXX: Final = ("c++", "-std=c++17", "-O1", "-w")
_CC: Final = ("cc", "-O1", "-w")


@dataclass(frozen=True, slots=True)
class Leaf:
    """One number of a pin.

    Attributes:
        steps: Names of members and places in arrays, the pin's own name first.
        type: Its type.
        shift: For each place in an array: the number of the first one.
    """

    steps: tuple[str | int, ...]
    type: ScalarType
    shift: tuple[int, ...] = ()

    def get(self, frame: Frame) -> float:
        """Read it in the interpreter's memory, whose steps are places."""
        for step in self.places[:-1]:
            frame = frame[step]
        return float(frame[self.places[-1]])

    def put(self, frame: Frame, number: float) -> None:
        """Write it there."""
        for step in self.places[:-1]:
            frame = frame[step]
        kept = {"BOOL": bool, "LREAL": float}.get(self.type.name, int)
        frame[self.places[-1]] = kept(number)

    places: tuple[int, ...] = ()


def leaves(block: BlockType) -> Iterator[Leaf]:
    """Return every number of the pins of a block, in order."""
    for pin in block.members.values():
        if pin.kind in _KINDS or pin.name == _HOLDER:
            yield from _below(pin.type, (pin.name,), (), (pin.slot,))


def _below(
    of: DataType, steps: tuple[str | int, ...], shift: tuple[int, ...], places: tuple[int, ...]
) -> Iterator[Leaf]:
    if isinstance(of, ScalarType):
        yield Leaf(steps, of, shift, places)
    elif isinstance(of, ArrayType):
        ((low, high),) = of.bounds
        for at in range(high - low + 1):
            yield from _below(of.element, (*steps, at), (*shift, low), (*places, at))
    elif isinstance(of, StructType):
        for name, member in of.members.items():
            yield from _below(member.type, (*steps, name), shift, (*places, member.slot))
    else:
        raise TypeError(of)


class IecCompiler:
    """A third-party compiler.

    Attributes:
        name: The compiler's name.
        command: Its name on the command line.
    """

    name: str
    command: str

    def missing(self) -> str:
        """Return the missing parts on this computer, empty for none."""
        if shutil.which(self.command) is None:
            return f"{self.name} is not on this computer: no {self.command} on the PATH"
        return ""

    def compiled(self, core: str, folder: Path) -> Path:
        """Return a program of the core in ``folder``."""
        raise NotImplementedError


class Matiec(IecCompiler):
    """beremiz/matiec, to C. ``MATIEC_LIB`` names its folder lib if it is not found."""

    name, command = "MATIEC", "iec2c"

    def missing(self) -> str:
        absent = super().missing()
        if not absent and not (self._lib / "C" / "accessor.h").is_file():
            return f"MATIEC's folder lib is not {self._lib}; name it by MATIEC_LIB"
        return absent

    @property
    def _lib(self) -> Path:
        beside = Path(shutil.which(self.command) or "").resolve().parent / "lib"
        return Path(os.environ.get("MATIEC_LIB", beside))

    def compiled(self, core: str, folder: Path) -> Path:
        source = folder / "core.st"
        source.write_text(core + _bench_text(core))
        _run([self.command, "-I", str(self._lib), "-T", str(folder), str(source)])
        (folder / "bench.c").write_text(_harness(core, _MATIEC_HEAD, _matiec_path))
        made = folder / "bench"
        _run([*_CC, f"-I{self._lib / 'C'}", f"-I{folder}", *_named(made, folder / "bench.c")])
        return made


class Strucpp(IecCompiler):
    """Autonomy-Logic/STruCpp, to C++. ``STRUCPP_RUNTIME`` names its headers if not found."""

    name, command = "STruC++", "strucpp"

    def missing(self) -> str:
        absent = super().missing()
        if not absent and not (self._runtime / "iec_var.hpp").is_file():
            return f"STruC++'s headers are not in {self._runtime}; name them by STRUCPP_RUNTIME"
        return absent

    @property
    def _runtime(self) -> Path:
        package = Path(shutil.which(self.command) or "").resolve().parents[2]
        return Path(os.environ.get("STRUCPP_RUNTIME", package / "src" / "runtime" / "include"))

    def compiled(self, core: str, folder: Path) -> Path:
        source = folder / "core.st"
        source.write_text(core + _bench_text(core))
        _run([self.command, str(source), "-o", str(folder / "core.cpp")])
        (folder / "bench.cpp").write_text(_harness(core, _STRUCPP_HEAD, _strucpp_path))
        made = folder / "bench"
        parts = [folder / "bench.cpp", folder / "core.cpp"]
        _run([*_CXX, f"-I{self._runtime}", f"-I{folder}", *_named(made, *parts)])
        return made


COMPILERS: Final[Sequence[IecCompiler]] = (Matiec(), Strucpp())


def _named(made: Path, *parts: Path) -> list[str]:
    return ["-o", str(made), *map(str, parts), "-lm", "-lrt"]


def _run(arguments: Sequence[str]) -> None:
    done = subprocess.run(arguments, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, f"{arguments}\n{done.stdout[-2000:]}\n{done.stderr[-4000:]}"


def _types(core: str) -> Mapping[str, DataType]:
    made = StructuredProgram([SourceText("robolink_core.st", core)], BLOCKS[0])
    return made._declared.types


def _blocks(types: Mapping[str, DataType]) -> Sequence[BlockType]:
    found = [types[name.upper()] for name in BLOCKS]
    return [block for block in found if isinstance(block, BlockType)]


def _bench_text(core: str) -> str:
    """Return a program that calls either block, with a variable for each of its pins."""
    types = _types(core)
    declared, branches = ["which : INT;"], []
    for at, block in enumerate(_blocks(types)):
        pins = [pin for pin in block.members.values() if pin.kind in _KINDS]
        declared += [f"p{at}{pin.name} : {_type_name(types, pin.type)};" for pin in pins]
        declared.append(f"b{at} : {block.name};")
        given = [f"{pin.name} := p{at}{pin.name}" for pin in pins if pin.kind != "var_output"]
        branches += [f"IF which = {at} THEN", f"b{at}({', '.join(given)});"]
        shown = (pin.name for pin in pins if pin.kind == "var_output")
        branches += [*(f"p{at}{name} := b{at}.{name};" for name in shown), "END_IF;"]
    return "\n".join([f"PROGRAM {_MAIN}", "VAR", *declared, "END_VAR", *branches, _TASK])


_TASK: Final = f"""\
END_PROGRAM
CONFIGURATION config
  RESOURCE res ON PLC
    TASK t(INTERVAL := T#4ms, PRIORITY := 0);
    PROGRAM inst WITH t : {_MAIN};
  END_RESOURCE
END_CONFIGURATION
"""


def _type_name(types: Mapping[str, DataType], of: DataType) -> str:
    """Return the name under which the core declares a type."""
    if isinstance(of, ScalarType | StructType):
        return of.name
    return next(name for name, one in types.items() if name.startswith("RL_") and one == of)


def _harness(core: str, head: str, path: Callable[[int, Leaf], str]) -> str:
    """Return the outer loop in C: which block, its numbers, one call, its numbers."""
    text = [head, "int main(void) {\n  static double n[8192];\n  double which;\n  start();\n"]
    text.append("  while (fread(&which, sizeof which, 1, stdin) == 1) {\n")
    for at, block in enumerate(_blocks(_types(core))):
        found = list(leaves(block))
        text.append(f"    if (which == {at}) {{\n")
        text.append(
            f"      if (fread(n, sizeof *n, {len(found)}, stdin) != {len(found)}) return 1;\n"
        )
        into = [(k, leaf) for k, leaf in enumerate(found) if leaf.steps[0] != _HOLDER]
        text += [f"      {path(at, leaf)} = {_cast(leaf, f'n[{k}]')};\n" for k, leaf in into]
        text.append(f"      run({at});\n")
        text += [
            f"      n[{k}] = (double){_cast(leaf, path(at, leaf))};\n"
            for k, leaf in enumerate(found)
        ]
        text.append(
            f"      fwrite(n, sizeof *n, {len(found)}, stdout);\n      fflush(stdout);\n    }}\n"
        )
    return "".join([*text, "  }\n  return 0;\n}\n"])


_C_TYPES: Final = {
    "BOOL": "uint8_t",
    "WORD": "uint16_t",
    "UINT": "uint16_t",
    "INT": "int16_t",
    "DINT": "int32_t",
    "UDINT": "uint32_t",
    "LREAL": "double",
}


def _cast(leaf: Leaf, text: str) -> str:
    return f"({_C_TYPES[leaf.type.name]})({text})"


_MATIEC_HEAD: Final = f"""\
#include <stdint.h>
#include <stdio.h>
#include "iec_std_lib.h"
#include "accessor.h"
#include "POUS.h"
#include "POUS.c"
TIME __CURRENT_TIME;
BOOL __DEBUG;
unsigned long long common_ticktime__ = 4000000ULL;
static {_MAIN.upper()} P;
static void start(void) {{ {_MAIN.upper()}_init__(&P, 0); }}
static void run(int which) {{ P.WHICH.value = which; {_MAIN.upper()}_body__(&P); }}
"""

_STRUCPP_HEAD: Final = f"""\
#include <cstdint>
#include <cstdio>
#include "core.hpp"
static strucpp::Program_{_MAIN.upper()} P;
static void start(void) {{}}
static void run(int which) {{ P.WHICH = (int16_t)which; P.run(); }}
"""


def _matiec_path(which: int, leaf: Leaf) -> str:
    name, *steps = leaf.steps
    if name == _HOLDER:
        return f"P.B{which}.HOLDER.value"
    inner = "".join(f".table[{s}]" if isinstance(s, int) else f".{s.upper()}" for s in steps)
    return f"P.P{which}{str(name).upper()}.value{inner}"


def _strucpp_path(which: int, leaf: Leaf) -> str:
    name, *steps = leaf.steps
    if name == _HOLDER:
        return f"P.B{which}.HOLDER"
    lows = iter(leaf.shift)
    inner = "".join(f"[{s + next(lows)}]" if isinstance(s, int) else f".{s.upper()}" for s in steps)
    return f"P.P{which}{str(name).upper()}{inner}"
