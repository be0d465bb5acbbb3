"""Files that a program opens, and Seek, Flush and Close (docs/reference/spel.md 18)."""

from collections.abc import Callable
from typing import Final

from robolink.messages import tr
from robolink_simulators.epson.spel.expressions.values import as_integer, as_text
from robolink_simulators.epson.spel.line_tree import ChannelStatement
from robolink_simulators.epson.spel.programs.emitter import Emitter
from robolink_simulators.epson.spel.programs.families.channels import channel_number
from robolink_simulators.epson.spel.tasks.compiled import Operation
from robolink_simulators.epson.spel.tasks.task import SpelTask
from robolink_simulators.epson.spel.tree import Name


def _open(emitter: Emitter, node: ChannelStatement) -> Operation:
    """ROpen, WOpen, AOpen, UOpen or BOpen name$ As #n."""
    number, name, way = channel_number(emitter, node), emitter.run(node.items[0]), node.word[0]
    return lambda t: t.runner.channels.files.open(number(t), as_text(name(t)), way, t)


def _close(emitter: Emitter, node: ChannelStatement) -> Operation:
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
    **dict.fromkeys(("ropen", "wopen", "aopen", "uopen", "bopen"), _open),
    "close": _close,
    "flush": _flush,
    "seek": _seek,
}
"""Keyword to what compiles it."""
