"""Network, serial and file statements; reading and writing of ports and files.

Source: docs/reference/spel.md 17, 18.

Files that a program opens, and Seek, Flush and Close (docs/reference/spel.md 18).
"""

import re
from collections.abc import Callable
from typing import Final, Literal

from robolink.messages import tr
from robolink.timing import NS_PER_S
from robolink_simulators.epson.condition import RefusalKind, SpelRefusal
from robolink_simulators.epson.spel.expressions.closures import Run
from robolink_simulators.epson.spel.expressions.functions import PLAIN_FUNCTIONS
from robolink_simulators.epson.spel.expressions.values import (
    Variable,
    as_integer,
    as_number,
    as_text,
    out_of_range,
)
from robolink_simulators.epson.spel.line_tree import ChannelStatement
from robolink_simulators.epson.spel.programs.emitter import Emitter
from robolink_simulators.epson.spel.programs.scope import Reference
from robolink_simulators.epson.spel.tasks.channels import USUAL_WINDOW
from robolink_simulators.epson.spel.tasks.compiled_program import Operation
from robolink_simulators.epson.spel.tasks.ports import PortSettings, SerialFormat
from robolink_simulators.epson.spel.tasks.task import SpelTask
from robolink_simulators.epson.spel.tasks.waits import WaitUntil
from robolink_simulators.epson.spel.tree import ByReference, Expression, Name

_TERMINATORS: Final = {"cr": b"\r", "lf": b"\n", "crlf": b"\r\n"}
_PARITIES: Final[dict[str, Literal["N", "O", "E"]]] = {"n": "N", "o": "O", "e": "E"}
_SLOWEST_BAUD: Final = 110
_FASTEST_BAUD: Final = 115_200
_COMMA_OR_BLANK: Final = re.compile(r"\s*,\s*|\s+")
_COMMA: Final = re.compile(r"\s*,\s*")
_BYTE: Final = 0xFF


def channel_number(emitter: Emitter, node: ChannelStatement) -> Callable[[SpelTask], int]:
    """Return what gives the number of a port or a file.

    Raises:
        ProgramFault: None stands there.
    """
    if node.channel is None:
        raise emitter.fault(tr("{word} needs a port", word=node.word), expected=("#201",))
    run = emitter.run(node.channel)
    return lambda t: as_integer(run(t))


def _set(emitter: Emitter, node: ChannelStatement) -> Operation:
    """SetNet #n, host, port, terminator, flow, time [, protocol ...]."""
    number = channel_number(emitter, node)
    host, port, end, *rest = node.items if len(node.items) > 2 else (*node.items, None, None, None)
    if host is None or port is None:
        raise emitter.fault(tr("SetNet needs a host and a port"))
    ending = _TERMINATORS.get(end.name if isinstance(end, Name) else "crlf")
    if ending is None:
        raise emitter.fault(tr("a line ends with one of these"), expected=("CR", "LF", "CRLF"))
    runs = (emitter.run(host), emitter.run(port))
    time = emitter.run(rest[1]) if len(rest) > 1 and rest[1] is not None else None
    protocol = rest[2] if len(rest) > 2 else None
    if isinstance(protocol, Name) and protocol.name.startswith("udp"):
        return _refusing("UDP")

    def go(t: SpelTask) -> None:
        address = (as_text(runs[0](t)), as_integer(runs[1](t)))
        seconds = 0.0 if time is None else float(as_number(time(t)))
        t.runner.ports.configure(number(t), PortSettings(address, ending, seconds))

    return go


def _set_line(emitter: Emitter, node: ChannelStatement) -> Operation:
    """SetCom #n, baud, data bits, stop bits, parity, end, RTS or NONE, XON or NONE, time."""
    number = channel_number(emitter, node)
    runs = [None if isinstance(item, Name) else emitter.run(item) for item in node.items[:8]]
    words = [item.name if isinstance(item, Name) else "" for item in node.items[:8]]
    words += [""] * (8 - len(words))
    runs += [None] * (8 - len(runs))
    ending = _TERMINATORS.get(words[4] or "crlf")
    if ending is None:
        raise emitter.fault(tr("a line ends with one of these"), expected=("CR", "LF", "CRLF"))
    parity = _PARITIES.get(words[3] or "n")
    if parity is None:
        raise emitter.fault(tr("parity is one of these"), expected=("O", "E", "N"))
    if {words[5], words[6]} - {"", "none"}:
        return _refusing("Flow control of a serial port")

    def go(t: SpelTask) -> None:
        numbers = [None if run is None else as_number(run(t)) for run in runs]
        baud, data_bits, stop_bits = (
            usual if value is None else int(value)
            for value, usual in zip(numbers[:3], (9600, 8, 1), strict=True)
        )
        known = _SLOWEST_BAUD <= baud <= _FASTEST_BAUD
        if not known or data_bits not in (7, 8) or stop_bits not in (1, 2):
            raise out_of_range(f"SetCom {baud}, {data_bits}, {stop_bits}")
        form = SerialFormat(baud, data_bits, stop_bits, parity)
        seconds = float(numbers[7] or 0)
        t.runner.ports.configure(number(t), PortSettings(("", 0), ending, seconds, form))

    return go


def _open_line(emitter: Emitter, node: ChannelStatement) -> Operation:
    number = channel_number(emitter, node)
    return lambda t: t.runner.ports.open_line(number(t), t)


def _open(emitter: Emitter, node: ChannelStatement) -> Operation:
    number = channel_number(emitter, node)
    if node.role not in ("client", "server"):
        raise emitter.fault(tr("OpenNet needs a role"), expected=("As Client", "As Server"))
    server = node.role == "server"
    return lambda t: t.runner.ports.open(number(t), t, server=server)


def _close(emitter: Emitter, node: ChannelStatement) -> Operation:
    if node.items == (Name("all"),):
        return lambda t: t.runner.ports.close_all()
    number = channel_number(emitter, node)
    return lambda t: t.runner.ports.close(number(t))


def _timed(t: SpelTask, out: bool) -> None:
    t.session.memory.timed_out = out


def _await(emitter: Emitter, node: ChannelStatement) -> Operation:
    """WaitNet: how it ended is told by TW (docs/reference/spel.md 4.6)."""
    number = channel_number(emitter, node)
    limit = emitter.run(node.items[0]) if node.items else None

    def go(t: SpelTask) -> WaitUntil:
        at = number(t)
        seconds = t.session.memory.wait_limit_s if limit is None else as_number(limit(t))
        unlimited = limit is None and not seconds

        def late() -> None:
            if limit is None:
                raise SpelRefusal(RefusalKind.NET_WAIT_TIMED_OUT, "The time of TMOut ran out")
            _timed(t, True)

        return WaitUntil(
            lambda: t.runner.ports.connected(at),
            lambda: _timed(t, False),
            end_ns=None if unlimited else t.now_ns + round(float(seconds) * NS_PER_S),
            out_of_time=late,
            polled=True,
        )

    return go


def _reading(
    t: SpelTask, at: int, ready: Callable[[], bool], take: Callable[[], None]
) -> WaitUntil:
    """Return a read that waits for what it needs, for the port's time, or for the link's end."""
    seconds = t.runner.channels.of(at).timeout_s(at)

    def late() -> None:
        raise SpelRefusal(RefusalKind.PORT_TIMED_OUT, f"Port {at}: nothing came in time")

    end_ns = t.now_ns + round(seconds * NS_PER_S) if seconds else None
    return WaitUntil(ready, take, end_ns=end_ns, out_of_time=late, polled=True)


def _line(t: SpelTask, at: int, take: Callable[[str], None]) -> WaitUntil:
    ports = t.runner.channels.of(at)

    def ready() -> bool:
        return ports.lines(at, t) > 0 or not ports.connected(at) or ports.foreign(at, t)

    def taken() -> None:
        line = ports.line(at, t)
        if line is not None:
            take(line)

    return _reading(t, at, ready, taken)


def _window_or(emitter: Emitter, node: ChannelStatement) -> Callable[[SpelTask], int]:
    if node.channel is None:
        return lambda _: USUAL_WINDOW
    return channel_number(emitter, node)


def _store(variable: Variable, value: str | int) -> None:
    variable.values[0] = variable.kind.store(value)


def _input(emitter: Emitter, node: ChannelStatement) -> Operation:
    """Input #n, variables: texts and numbers between commas or blanks.

    Without a port a person at the window is asked, as with the number of the window.
    """
    number = _window_or(emitter, node)
    references = [emitter.variable_for(item) for item in node.items]

    def go(t: SpelTask) -> WaitUntil:
        variables = [reference(t) for reference in references]

        def take(line: str) -> None:
            texts = [variable.kind.name == "string" for variable in variables]
            together = t.session.options.input_blank == "between_variables"
            parts = _data(line, len(variables), ends_with_text=together and texts[-1])
            if len(parts) != len(variables):
                raise SpelRefusal(RefusalKind.INPUT_COUNT, f"{len(parts)} data came")
            for variable, part, text in zip(variables, parts, texts, strict=True):
                variable.values[0] = variable.kind.store(part if text else _value(part))

        return _line(t, number(t), take)

    return go


def _data(line: str, count: int, *, ends_with_text: bool) -> list[str]:
    """Return the data of a line: more than are wanted, or fewer, where their count is wrong.

    Args:
        line: What came.
        count: How many are wanted.
        ends_with_text: Whether the last of them is a text, to which blanks belong.
    """
    rest, parts = line.strip(), list[str]()
    while rest or parts[-1:] == [""]:
        last = ends_with_text and len(parts) == count - 1
        part, *behind = (_COMMA if last else _COMMA_OR_BLANK).split(rest, maxsplit=1)
        parts.append(part)
        if not behind:
            break
        rest = behind[0]
    return parts


def _value(text: str) -> int | float:
    return as_number(PLAIN_FUNCTIONS["val"][1]([text]))


def _line_input(emitter: Emitter, node: ChannelStatement) -> Operation:
    if len(node.items) != 1:
        raise emitter.fault(tr("Line Input takes one variable"))
    number = _window_or(emitter, node)
    reference = emitter.variable_for(node.items[0])

    def go(t: SpelTask) -> WaitUntil:
        variable = reference(t)
        return _line(t, number(t), lambda line: _store(variable, line))

    return go


def _bytes(t: SpelTask, at: int, count: int, take: Callable[[bytes], None]) -> WaitUntil:
    ports = t.runner.channels.of(at)

    def ready() -> bool:
        waiting = ports.waiting_bytes(at, t)
        return waiting < 0 or waiting >= count or not ports.connected(at)

    def taken() -> None:
        data = ports.bytes(at, count, t)
        if data is not None:
            take(data)

    return _reading(t, at, ready, taken)


def _read(emitter: Emitter, node: ChannelStatement) -> Operation:
    """Read #n, s$, count."""
    number, (item, amount) = channel_number(emitter, node), _two(emitter, node)
    reference, count = emitter.variable_for(item), emitter.run(amount)

    def go(t: SpelTask) -> WaitUntil:
        variable, wanted = reference(t), as_integer(count(t))
        return _bytes(t, number(t), wanted, lambda data: _store(variable, data.decode("latin-1")))

    return go


def _two(emitter: Emitter, node: ChannelStatement) -> tuple[Expression, Expression]:
    if len(node.items) != 2:
        raise emitter.fault(tr("{word} takes a variable and a count", word=node.word))
    return node.items[0], node.items[1]


def _holder(emitter: Emitter, item: Expression) -> Reference:
    given = item.target if isinstance(item, ByReference) else item
    if isinstance(given, Name) and emitter.scope.is_array(given.name) and not given.arguments:
        return emitter.array(given)
    return emitter.variable_for(item)


def _read_binary(emitter: Emitter, node: ChannelStatement) -> Operation:
    """ReadBin #n, variable, or ReadBin #n, array(), count."""
    number = channel_number(emitter, node)
    reference = _holder(emitter, node.items[0])
    count = emitter.run(node.items[1]) if len(node.items) > 1 else None

    def go(t: SpelTask) -> WaitUntil:
        variable = reference(t)
        t.runner.channels.of(number(t)).require_binary(number(t), t)
        wanted = 1 if count is None else as_integer(count(t))
        if not 0 <= wanted <= len(variable.values):
            raise SpelRefusal(RefusalKind.SUBSCRIPT, f"{wanted} bytes do not fit")

        def take(data: bytes) -> None:
            for index, byte in enumerate(data):
                variable.values[index] = variable.kind.store(byte)

        return _bytes(t, number(t), wanted, take)

    return go


def _write(emitter: Emitter, node: ChannelStatement) -> Operation:
    """Write #n, text: nothing is added to it."""
    number = channel_number(emitter, node)
    if len(node.items) != 1:
        raise emitter.fault(tr("Write takes one text"))
    text = emitter.run(node.items[0])
    return lambda t: t.write_to(number(t), as_text(text(t)), ends=False)


def _write_binary(emitter: Emitter, node: ChannelStatement) -> Operation:
    number = channel_number(emitter, node)
    item, count = node.items[0], node.items[1:]
    run: Run | None = emitter.run(count[0]) if count else None
    if run is None:
        value = emitter.run(item)
        return lambda t: _send(t, number(t), bytes([as_integer(value(t)) & _BYTE]))
    reference = _holder(emitter, item)

    def go(t: SpelTask) -> None:
        wanted, values = as_integer(run(t)), reference(t).values
        if not 0 <= wanted <= len(values):
            raise SpelRefusal(RefusalKind.SUBSCRIPT, f"There are no {wanted} bytes")
        data = bytes(as_integer(value) & _BYTE for value in map(values.__getitem__, range(wanted)))
        _send(t, number(t), data)

    return go


def _send(t: SpelTask, at: int, data: bytes) -> None:
    """Write bytes to a port, or to a file that BOpen has opened."""
    channel = t.runner.channels.of(at)
    channel.require_binary(at, t)
    channel.write_bytes(at, data, t)


def _refusing(word: str) -> Operation:
    def go(_: SpelTask) -> None:
        raise SpelRefusal(RefusalKind.NOT_SIMULATED, f"{word} is not simulated")

    return go


CHANNEL_STATEMENTS: Final[dict[str, Callable[[Emitter, ChannelStatement], Operation]]] = {
    "setnet": _set,
    "opennet": _open,
    "closenet": _close,
    "setcom": _set_line,
    "opencom": _open_line,
    "closecom": _close,
    "waitnet": _await,
    "input": _input,
    "line input": _line_input,
    "read": _read,
    "readbin": _read_binary,
    "write": _write,
    "writebin": _write_binary,
}
"""Compilers of statements by keyword."""


def _open_file(emitter: Emitter, node: ChannelStatement) -> Operation:
    """ROpen, WOpen, AOpen, UOpen or BOpen name$ As #n."""
    number, name, way = channel_number(emitter, node), emitter.run(node.items[0]), node.word[0]
    return lambda t: t.runner.channels.files.open(number(t), as_text(name(t)), way, t)


def _close_file(emitter: Emitter, node: ChannelStatement) -> Operation:
    """Close #n; that All closes the files of the task is inferred from CloseNet."""
    if node.items == (Name("all"),):
        return lambda t: t.runner.channels.files.close_of(t)
    number = channel_number(emitter, node)
    return lambda t: t.runner.channels.files.close(number(t))


def _flush(emitter: Emitter, node: ChannelStatement) -> Operation:
    number = channel_number(emitter, node)
    return lambda t: t.runner.channels.files.flush(number(t), t)


def _seek(emitter: Emitter, node: ChannelStatement) -> Operation:
    number = channel_number(emitter, node)
    if len(node.items) != 1:
        raise emitter.fault(tr("{word} takes other values", word="Seek"))
    position = emitter.run(node.items[0])

    def go(t: SpelTask) -> None:
        t.runner.channels.files.seek(number(t), as_integer(position(t)), t)

    return go


FILE_STATEMENTS: Final[dict[str, Callable[[Emitter, ChannelStatement], Operation]]] = {
    **dict.fromkeys(("ropen", "wopen", "aopen", "uopen", "bopen"), _open_file),
    "close": _close_file,
    "flush": _flush,
    "seek": _seek,
}
"""Compilers of statements by keyword."""
