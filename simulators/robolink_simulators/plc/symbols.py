"""The variables of a simulated PLC with a map of symbols, as an OPC UA server has them."""

import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from typing import Any, Final

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.register_maps import SymbolMap
from robolink_simulators.faults import Departure, Fault, FaultAction
from robolink_simulators.faults.links import OF_OPCUA
from robolink_simulators.hosting.fieldbus.opcua_symbols import (
    ServedSymbols,
    Symbol,
    SymbolValue,
)
from robolink_simulators.hosting.fieldbus.opcua_tearing import mixed
from robolink_simulators.plc.device import PlcSimulator
from robolink_simulators.plc.memory import SymbolMemory, SymbolVariable

_NUMBERED: Final = re.compile(r"(?:ns=\d+;)?s=\|var\|(?P<device>.+)\.Application\.(?P<path>.+)")
_REFUSALS: Final = frozenset({FaultAction.OUT_OF_SERVICE, FaultAction.LOSE_SESSION})
_REFUSED_WRITES: Final = frozenset({FaultAction.READ_ONLY, FaultAction.WRONG_TYPE})
_UNANSWERED: Final = frozenset({FaultAction.DROP_REPLY, FaultAction.DROP_REQUEST})

_Carried = tuple[tuple[SymbolValue, ...], float]
"""Values of an answer, and how many seconds late the last of what was written arrives."""


class PlcSymbols:
    """The variables of a map, as ``hosting.fieldbus.opcua_symbols.PublishedSymbols`` describes.

    Requests read ``read GVL.aTool1, GVL.aTool2`` and ``write GVL.aTool1``.

    Args:
        plc: Whose.

    Raises:
        ConfigError: Its map names registers.
    """

    def __init__(self, plc: PlcSimulator) -> None:
        if not isinstance(plc.register_map, SymbolMap):
            raise ConfigError(
                tr("{map} names registers, not symbols.", map=plc.register_map.name),
                remedy=tr("Serve it over Modbus, or give a map of symbols (docs/plc-maps.md)."),
            )
        self._plc = plc
        devices, made = [], {}
        for node, variable in self._memory().variables.items():
            device, symbol = _symbol(node, variable)
            devices += [device] if device else []
            made[symbol] = node
        self.device = devices[0] if devices else "Simulated PLC"
        self._nodes: Mapping[Symbol, str] = made

    @property
    def symbols(self) -> Sequence[Symbol]:
        """See ``PublishedSymbols.symbols``."""
        return tuple(self._nodes)

    @property
    def cycle_s(self) -> float:
        """See ``PublishedSymbols.cycle_s``."""
        return self._plc.program.cycle_s

    @property
    def answer_s(self) -> float:
        """See ``PublishedSymbols.answer_s``."""
        return self._plc.answer_s

    @property
    def lock(self) -> AbstractContextManager[object]:
        """See ``PublishedSymbols.lock``."""
        return self._plc.lock

    @property
    def ends(self) -> tuple[int, int]:
        """See ``PublishedSymbols.ends``."""
        return self._plc.starts, self._plc.cuts

    def read(
        self, symbols: Sequence[Symbol], now_ns: int, *, counted: bool = False
    ) -> ServedSymbols:
        """See ``PublishedSymbols.read``."""
        with self._plc.lock:
            shown = f"read {_listed(symbols)}"
            return self._serve(
                shown, len(symbols), now_ns, lambda _: (self._values(symbols), 0.0), counted=counted
            )

    def write(
        self, values: Sequence[tuple[Symbol, SymbolValue]], now_ns: int, *, counted: bool = False
    ) -> ServedSymbols:
        """See ``PublishedSymbols.write``."""

        def carry_out(torn: Fault | None) -> _Carried:
            halves = self._halves(torn, values)
            self._store({**dict(values), **halves})
            self._plc.note_write(shown)
            if torn is None or not halves:
                return (), 0.0
            starts, late_s = self._plc.starts, torn.seconds or self.cycle_s

            def arrive() -> None:
                if self._plc.starts == starts:
                    self._store(dict(values))
                    self._plc.program.written(self._plc.now_ns)

            self._plc.act_after(late_s, arrive)
            return (), late_s

        with self._plc.lock:
            shown = f"write {_listed([symbol for symbol, _ in values])}"
            return self._serve(shown, len(values), now_ns, carry_out, counted=counted)

    def note(self, shown: str, now_ns: int) -> None:
        """See ``PublishedSymbols.note``."""
        with self._plc.lock:
            self._plc.log.add(now_ns, ">", shown)

    def take_back(self, faults: Sequence[Fault]) -> None:
        """See ``PublishedSymbols.take_back``."""
        with self._plc.lock:
            for fault in faults:
                self._plc.faults.take_back(fault)

    def peek(self, symbols: Sequence[Symbol], now_ns: int) -> tuple[SymbolValue, ...]:
        """See ``PublishedSymbols.peek``."""
        with self._plc.lock:
            self._plc.advance(now_ns)
            return self._values(symbols)

    def _serve(
        self,
        shown: str,
        count: int,
        now_ns: int,
        carry_out: Callable[[Fault | None], _Carried],
        *,
        counted: bool,
    ) -> ServedSymbols:
        plc = self._plc
        plc.advance(now_ns)
        if not counted:
            plc.log.add(plc.now_ns, ">", shown)
        met = () if counted else plc.faults.take(shown)
        actions = {fault.action: fault for fault in met}
        if FaultAction.DISCONNECT_BEFORE in actions:
            return ServedSymbols((), _ending)
        if FaultAction.DROP_REQUEST in actions:
            return ServedSymbols((), _ending, answered=False)
        if (stall := actions.get(FaultAction.STALL)) is not None:
            return ServedSymbols((), _ending, stalled_s=stall.seconds)
        if (restart := actions.get(FaultAction.RESTART)) is not None:
            plc.act_after(restart.seconds, plc.restart)
        refused = _REFUSALS if shown.startswith("read") else _REFUSALS | _REFUSED_WRITES
        left_out = not refused.isdisjoint(actions)
        ignored = FaultAction.IGNORE_WRITE in actions and not shown.startswith("read")
        torn = actions.get(FaultAction.TEAR_WRITE)
        values, late_s = plc.exchange(
            shown, lambda: ((), 0.0) if left_out or ignored else carry_out(torn)
        )
        again = actions.get(FaultAction.DUPLICATE_REQUEST)
        if again is not None and not (left_out or ignored):
            carry_out(None)
        waiting = {FaultAction.TEAR_WRITE} if not late_s else set()
        of_server = tuple(fault for fault in met if fault.action in OF_OPCUA | waiting)

        def departures(answer: bytes) -> Sequence[Departure]:
            leaving = plc.faults.departures(answer, met, after_s=plc.answer_s + late_s)
            return leaving if again is None else [*leaving, (again.seconds + plc.answer_s, answer)]

        return ServedSymbols(
            values,
            departures,
            (of_server,) * count,
            answered=_UNANSWERED.isdisjoint(actions),
        )

    def _halves(
        self, torn: Fault | None, values: Sequence[tuple[Symbol, SymbolValue]]
    ) -> dict[Symbol, SymbolValue]:
        """Return what there is of arrays and structures before their rest arrives."""
        halves: dict[Symbol, SymbolValue] = {}
        for symbol, value in values:
            held = _shown(self._variable(symbol))
            if torn is not None and isinstance(value, tuple) and isinstance(held, tuple):
                half = mixed(torn, value, held)
                if half is not None:
                    halves[symbol] = half
        return halves

    def _store(self, values: Mapping[Symbol, SymbolValue]) -> None:
        for symbol, value in values.items():
            variable = self._variable(symbol)
            variable.value = _held(variable, value)

    def _memory(self) -> SymbolMemory:
        memory: SymbolMemory = self._plc.program.memory  # made anew with the PLC
        return memory

    def _values(self, symbols: Sequence[Symbol]) -> tuple[SymbolValue, ...]:
        return tuple(_shown(self._variable(symbol)) for symbol in symbols)

    def _variable(self, symbol: Symbol) -> SymbolVariable:
        return self._memory().variables[self._nodes[symbol]]


def _symbol(node: str, variable: SymbolVariable) -> tuple[str, Symbol]:
    """Return the device that a node names, empty for none, and the node as a variable of a list."""
    found = _NUMBERED.fullmatch(node)
    if found:
        device, way = found["device"], found["path"].rsplit(".", 1)
    else:
        steps = [step.rpartition(":")[2] for step in node.split("/")]
        device = steps[steps.index("DeviceSet") + 1] if "DeviceSet" in steps[:-1] else ""
        way = steps[-2:] if node.startswith("/") else ["GVL", node.rpartition("=")[2]]
    variables, name = way if len(way) == 2 else ("GVL", way[0])
    held = variable.value
    return device, Symbol(
        variables,
        name,
        variable.kind,
        length=len(held) if isinstance(held, list) else None,
        writable=variable.written,
        node="" if node.startswith("/") else node,
        fields=tuple(variable.kinds.items()),
    )


def _shown(variable: SymbolVariable) -> SymbolValue:
    held = variable.value
    if isinstance(held, dict):
        return tuple(held.values())
    return tuple(held) if isinstance(held, list) else held


def _held(variable: SymbolVariable, value: Any) -> Any:  # noqa: ANN401 - checked by the server
    if variable.kinds:
        return dict(zip(variable.kinds, value, strict=True))
    return list(value) if isinstance(value, tuple) else value


def _listed(symbols: Sequence[Symbol]) -> str:
    return ", ".join(symbol.path for symbol in symbols)


def _ending(_answer: bytes) -> Sequence[Departure]:
    return [(0.0, None)]
