"""One tool write through a PLC's mailbox against the bare calls that it cannot do without.

Those are: the slot and the response block (may it be written?), the response again just before
the command block leaves, the head until it acknowledges, the response (how did it end?), and
the slot (what is there now?). The floor makes them with pymodbus, or with canopen's SDO client
and its subscription of TPDO1, and decodes nothing; its command blocks are encoded beforehand.
The driver keeps its journal in memory, so that only the link is compared. As in
:mod:`benchmarks.links.exchange` the simulator has a process, and where there are two a CPU, of its
own; its program looks at the mailbox every 4 ms, as a PLC does, and both sides wait for that.

Each write begins at another point of that cycle, as a lone write does. Back to back both sides
fall into step with it: a write then takes one cycle or two, and where the driver's comes near
the end of one the ratio is 1.05 in one run and 1.55 in the next. The median over the rounds is
taken for each point by itself, and then the mean over the cycle.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import count
from statistics import fmean, median
from time import perf_counter_ns
from typing import Final

import robolink
from benchmarks.links.bare_links import ACK, SLOT, Bare, bare_can, bare_modbus, free_port
from benchmarks.links.placing import a_cpu_each, served_simulator
from benchmarks.table import Amount, Figure
from robolink.journal import memory_journal
from robolink.model import ToolOffset
from robolink.protocols.mailbox import (
    Command,
    Opcode,
    Words,
    encode_command,
)

ROUNDS: Final = 9
WRITES: Final = 20
WARM_UP: Final = 4
GOAL: Final = 1.3

_OWNER: Final = 0xBE7C
_EPOCH: Final = 14
_CYCLE_NS: Final = 4_000_000
"""Period of the simulated mailbox program in ns."""

_OFFSETS: Final = (ToolOffset(12.0, -3.5, -20.0), ToolOffset(12.125, -3.25, -20.0))
_POSES: Final = ((12.0, -3.5, -20.0, 0.0, 0.0, 0.0), (12.125, -3.25, -20.0, 0.0, 0.0, 0.0))
_GROUP: Final = "239.74.163.8"


def measure_mailbox() -> Iterator[Figure]:
    """Yield the figures of a tool write over Modbus TCP and over CAN."""
    can = f"udp_multicast:{_GROUP}:{free_port()}"
    with a_cpu_each() as simulator_cpu:
        serving = ("softmotion", "--tcp", "127.0.0.1:0")
        yield from _compare("Modbus TCP", "pymodbus", serving, bare_modbus, simulator_cpu)
        yield from _compare("CAN", "canopen", ("softmotion", "--can", can), bare_can, simulator_cpu)


def _compare(
    link: str, library: str, serving: tuple[str, ...], bare: Bare, simulator_cpu: int | None
) -> Iterator[Figure]:
    with served_simulator(simulator_cpu, serving) as url:
        rounds = [(_floor_round(url, bare), _driver_round(url)) for _ in range(ROUNDS)]
    floor, driver = (_typical_us(side) for side in zip(*rounds, strict=True))
    yield Figure(
        f"mailbox tool write over {link}, journal in memory",
        Amount(driver, "us"),
        f"the same calls by bare {library}",
        Amount(floor, "us"),
        driver / floor,
        GOAL,
    )


def _typical_us(rounds: Sequence[Sequence[int]]) -> float:
    """Return the mean over the cycle of what each of its points takes as a rule.

    Args:
        rounds: Of each round the nanoseconds of a write, by where in the cycle it began.
    """
    return fmean(median(writes) for writes in zip(*rounds, strict=True)) / 1000


def _driver_round(url: str) -> list[int]:
    with robolink.connect(url, outcomes=memory_journal(url).log(url)) as controller:
        stored = controller.tools.read(SLOT)

        def write(number: int) -> None:
            nonlocal stored
            offset = _OFFSETS[number % 2]
            stored = controller.tools.write(SLOT, offset, expected=stored).read_back

        return _nanoseconds(write)


def _floor_round(url: str, bare: Bare) -> list[int]:
    with bare(url) as client:
        sequence = count(client.read_response()[ACK] % 0xFFFF + 1)

        def carry_out(words: Words) -> Words:
            client.write_command(words)
            client.await_head(words[0])
            return client.read_response()

        def owned(taken: int, epoch: int = 0) -> Words:
            operands = (taken, 0, 0, 0)
            command = Command(next(sequence), Opcode.OWNERSHIP, operands=operands)
            return carry_out(_encoded(command, epoch))

        epoch = owned(1)[_EPOCH]
        blocks = [_write_block(next(sequence), number, epoch) for number in range(WARM_UP + WRITES)]

        def write(number: int) -> None:
            client.read_slot()
            client.read_response()
            client.read_response()
            carry_out(blocks[number])
            client.read_slot()

        try:
            return _nanoseconds(write)
        finally:
            owned(0, epoch)


def _write_block(sequence: int, number: int, epoch: int) -> Words:
    command = Command(
        sequence,
        Opcode.WRITE_TOOL,
        operands=(SLOT, 0, 0, 0),
        pose=_POSES[number % 2],
        name="bare",
    )
    return _encoded(command, epoch)


def _encoded(command: Command, epoch: int) -> Words:
    return encode_command(replace(command, owner=_OWNER, epoch=epoch))


def _nanoseconds(write: Callable[[int], None]) -> list[int]:
    """Return how long each write takes; each begins later in the cycle than the one before."""
    for number in range(WARM_UP):
        write(number)
    passed_ns = []
    for number in range(WRITES):
        due_ns = perf_counter_ns() + _CYCLE_NS * number // WRITES
        while (begin_ns := perf_counter_ns()) < due_ns:
            pass
        write(WARM_UP + number)
        passed_ns.append(perf_counter_ns() - begin_ns)
    return passed_ns
