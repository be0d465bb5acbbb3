"""Several cells at once: by their names, by a pattern, or by a group of the cell files.

A word is, in this order, the name of a cell, ``@GROUP``, or a pattern with ``*``, ``?`` or
``[...]`` over the names of all cells. What names nobody is refused by its word: a night job that
checks none of its cells would end well.
"""

from collections.abc import Iterable, Mapping, Sequence
from fnmatch import fnmatchcase
from typing import Final

from robolink.errors import ConfigError
from robolink.messages import known_names, tr

GROUP_MARK: Final = "@"
"""What stands before the name of a group where cells are named."""

_WILD: Final = frozenset("*?[")


def names_meant(
    words: Iterable[str], cells: Sequence[str], groups: Mapping[str, Sequence[str]]
) -> tuple[str, ...]:
    """Return the names of the cells that words name, each once, in the order of the words.

    What one pattern names comes in the order of the cells.

    Args:
        words: Names, patterns and ``@GROUP``.
        cells: The names of all cells, in their order.
        groups: The words of each group.

    Raises:
        ConfigError: A word names no cell.

    Example:
        >>> from robolink.config import names_meant
        >>> names_meant(["glue", "line3-?"], ["line3-1", "glue", "line3-2"], {})
        ('glue', 'line3-1', 'line3-2')
    """
    found: dict[str, None] = {}
    for word in words:
        found |= dict.fromkeys(_named(word, cells, groups))
    return tuple(found)


def _named(word: str, cells: Sequence[str], groups: Mapping[str, Sequence[str]]) -> list[str]:
    if word in cells or not word.startswith(GROUP_MARK):
        return _matching(word, cells)
    name = word.removeprefix(GROUP_MARK)
    if name not in groups:
        raise ConfigError(
            tr("There is no group {name!r} in the cell files.", name=name),
            remedy=known_names([f"{GROUP_MARK}{group}" for group in groups], word)
            if groups
            else tr("Describe it in a cell file, under [groups]: docs/cell-files.md"),
        )
    members: list[str] = []
    for member in groups[name]:
        try:
            members += _matching(member, cells)
        except ConfigError as error:
            raise ConfigError(
                tr("Group {name}: {what}", name=name, what=error.what), remedy=error.remedy
            ) from error
    return members


def _matching(word: str, cells: Sequence[str]) -> list[str]:
    """Return the cells of one name or pattern.

    Raises:
        ConfigError: There is none.
    """
    if word in cells:
        return [word]
    if not (_WILD.intersection(word) and cells):
        raise unknown_cell(word, cells)
    found = [name for name in cells if fnmatchcase(name, word)]
    if not found:
        raise ConfigError(
            tr("No cell has a name like {word!r}.", word=word), remedy=known_names(cells, word)
        )
    return found


def unknown_cell(name: str, cells: Iterable[str]) -> ConfigError:
    """Return the error about a cell that is in no file.

    Args:
        name: What was named.
        cells: The names that there are.
    """
    known = list(cells)
    if known:
        remedy = known_names(known, name)
    else:
        remedy = tr(
            "No cell file was found; 'robolink cell files' shows where robolink looks for "
            "one. A URL such as epson+tcp://192.168.0.1:5000 needs none."
        )
    return ConfigError(tr("There is no cell {name!r}.", name=name), remedy=remedy)
