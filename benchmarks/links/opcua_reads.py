"""A read over OPC UA against one over Modbus: bare, of a mailbox, and of a tool of a map.

For the first two lines both servers hold values that stand still and share a process and, where
there are two, a CPU of their own. Mailbox and tools are read at simulated PLCs, over both links by
our own clients. A tool of a map is read twice over both, and over OPC UA the second time after a
cycle of the PLC, which that line contains. A read is timed alone; the figure is the median of all.
"""

import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing
from functools import partial
from pathlib import Path
from statistics import median
from time import perf_counter_ns
from typing import Final

from pymodbus.client import ModbusTcpClient
from robolink_simulators.testkit.operator import written_map, written_symbol_map

import robolink
from benchmarks.links.bare_servers import ARRAY, LREALS, WORDS
from benchmarks.links.placing import answering, served_simulators
from benchmarks.table import Amount, Figure
from robolink.journal import memory_journal
from robolink.transport import open_mailbox_link, parse_url
from robolink.transport.opcua.opening import open_opcua

READS: Final = 1_000
TOOL_READS: Final = 20
ROUNDS: Final = 7
PLAIN_GOAL: Final = 2.5
ENCRYPTED_GOAL: Final = 4.0
_PLAIN: Final = "security=none&write_unsecured=yes"


def opcua_reads(cpu: int | None) -> Iterator[Figure]:
    """Yield the figures of reads; servers and simulator are on the CPU ``cpu``."""
    bare = [sys.executable, "-m", "benchmarks.links.bare_servers"]
    with answering(bare, cpu) as where, ExitStack() as stack:
        modbus = stack.enter_context(ModbusTcpClient("127.0.0.1", port=where["modbus"]))
        for options, how, goal in (
            (_PLAIN, "not encrypted", PLAIN_GOAL),
            (f"server_certificate={where['server_certificate']}", "Basic256Sha256", ENCRYPTED_GOAL),
        ):
            url = parse_url(f"plc+opcua://127.0.0.1:{where['opcua']}?{options}")
            client = stack.enter_context(closing(open_opcua(url)))
            yield _compared(
                f"array of {LREALS} LREAL over OPC UA, {how}",
                partial(client.read, [ARRAY]),
                f"FC03 of {WORDS} words by bare pymodbus",
                lambda: modbus.read_holding_registers(0, count=WORDS),
                goal,
            )
    yield from _mailbox(cpu)
    yield from _tool_of_a_map(cpu)


def _mailbox(cpu: int | None) -> Iterator[Figure]:
    serving = ("softmotion", "--tcp", "127.0.0.1:0", "--opcua", "127.0.0.1:0")
    with served_simulators(cpu, serving) as told, ExitStack() as stack:
        over_modbus, over_opcua = (
            stack.enter_context(closing(open_mailbox_link(told["urls"][medium])))
            for medium in ("modbus-tcp", "opcua")
        )
        yield _compared(
            "response block of a mailbox over OPC UA",
            over_opcua.read_response,
            "the same over Modbus TCP",
            over_modbus.read_response,
            None,
        )


def _tool_of_a_map(cpu: int | None) -> Iterator[Figure]:
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        reads = []
        for medium, option, path in (
            ("opcua-unsecured", "--opcua", written_symbol_map(folder)),
            ("modbus-tcp", "--tcp", written_map(folder)),
        ):
            serving = ("plc", "--map", str(path), option, "127.0.0.1:0")
            url = stack.enter_context(served_simulators(cpu, serving))["urls"][medium]
            log = memory_journal(url).log(url)
            controller = stack.enter_context(robolink.connect(url, outcomes=log))
            reads.append(partial(controller.tools.read, 1))
        over_opcua, over_modbus = reads
        yield _compared(
            "tool of a map over OPC UA, not encrypted",
            over_opcua,
            "a tool of a map over Modbus TCP",
            over_modbus,
            None,
            TOOL_READS,
        )


def _compared(
    name: str,
    ours: Callable[[], object],
    against: str,
    floor: Callable[[], object],
    goal: float | None,
    reads: int = READS,
) -> Figure:
    rounds = [(_typical_us(floor, reads), _typical_us(ours, reads)) for _ in range(ROUNDS)]
    bare, one = (Amount(median(column), "us") for column in zip(*rounds, strict=True))
    return Figure(name, one, against, bare, median(b / a for a, b in rounds), goal)


def _typical_us(read: Callable[[], object], reads: int) -> float:
    """Return the median of many reads."""
    passed_ns = []
    for _ in range(reads // 10):
        read()
    for _ in range(reads):
        began_ns = perf_counter_ns()
        read()
        passed_ns.append(perf_counter_ns() - began_ns)
    return median(passed_ns) / 1000
