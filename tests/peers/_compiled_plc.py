"""A PLC whose core is compiled by a third-party compiler, with its other texts interpreted."""

import struct
import subprocess
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from robolink_simulators.softmotion.catalogue import MachineModel
from robolink_simulators.softmotion.mailbox.option_text import PlcOptions
from robolink_simulators.softmotion.program.structured_plc import StructuredPlc
from robolink_simulators.structured_text.data_types import BlockType, Frame

from tests.peers._iec_compilers import BLOCKS, leaves
from tests.unit.structured_text._behaviours import sources


class CompiledCore:
    """A process that executes the compiled core; restarted with each start of the PLC.

    Attributes:
        calls: The number of calls.
    """

    def __init__(self, program: Path, served: ExitStack) -> None:
        self._program = program
        self._served = served
        self._process: subprocess.Popen[bytes] | None = None
        self.calls = 0

    def take_over(self, block: BlockType, which: int) -> None:
        """Let the compiled block act in place of the interpreted one."""
        found = list(leaves(block))

        def run(frame: Frame) -> None:
            numbers = [float(which), *(leaf.get(frame) for leaf in found)]
            for leaf, number in zip(found, self._answer(numbers), strict=True):
                leaf.put(frame, number)

        block.run = run
        if which == 0:
            block.made = self._restart

    def _answer(self, numbers: list[float]) -> tuple[float, ...]:
        process = self._process
        assert process is not None
        assert process.stdin is not None
        assert process.stdout is not None
        process.stdin.write(struct.pack(f"<{len(numbers)}d", *numbers))
        process.stdin.flush()
        self.calls += 1
        size = 8 * (len(numbers) - 1)
        told = process.stdout.read(size)
        assert len(told) == size, f"{self._program} has ended: {process.poll()}"
        return struct.unpack(f"<{len(numbers) - 1}d", told)

    def _restart(self, _: Frame) -> None:
        self._process = self._served.enter_context(
            subprocess.Popen([self._program], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        )


def compiled_plc(
    program: Path, served: ExitStack, cores: list[CompiledCore]
) -> Callable[[MachineModel, Mapping[str, float], PlcOptions], StructuredPlc]:
    """Return a maker of PLCs with the compiled core; ``cores`` gets it, for its count of calls."""

    def make(model: MachineModel, parameters: Mapping[str, float], options: PlcOptions) -> Any:
        plc = StructuredPlc(model, parameters, options, sources(model.kinematics.name))
        core = CompiledCore(program, served)
        cores.append(core)
        types = plc._executed.structured._declared.types
        for which, name in enumerate(BLOCKS):
            block = types[name.upper()]
            assert isinstance(block, BlockType)
            core.take_over(block, which)
        plc._executed.structured.restart()
        return plc

    return make
