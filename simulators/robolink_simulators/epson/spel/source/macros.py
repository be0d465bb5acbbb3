"""What ``#define`` gives a name to (docs/reference/spel.md 1.1)."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

LONGEST_EXPANSION: Final = 8192
"""Characters of a line after its macros (not stated; a macro may name its parameter twice, so that
thirty of them inside each other would fill any memory)."""

_TOKENS: Final = re.compile(
    r'"[^"]*(?:"|$)|&[hbo][0-9a-f]+|[a-z][a-z0-9_]*\$?|.', re.IGNORECASE | re.DOTALL
)
_WORDS: Final = re.compile(r'"[^"]*"|[a-z][a-z0-9_]*\$?', re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class Macro:
    """A text; where it has parameters, they are replaced by what is written in parentheses."""

    parameters: tuple[str, ...]
    text: str

    def applied(self, arguments: list[str]) -> str:
        """Return the text with its parameters replaced, wherever they stand as words."""
        given = {p.lower(): a.strip() for p, a in zip(self.parameters, arguments, strict=False)}
        return _WORDS.sub(lambda match: given.get(match[0].lower(), match[0]), self.text)


def expanded(line: str, macros: Mapping[str, Macro]) -> str:
    """Return a line with macros replaced outside of texts.

    The text of a macro holds no other macro (documented), so it is not looked at again; what
    stands in its parentheses is.

    Raises:
        OverflowError: It grows beyond :data:`LONGEST_EXPANSION`.
    """
    if not macros:
        return line
    tokens = _TOKENS.findall(line)
    written, position = list[str](), 0
    while position < len(tokens):
        macro = macros.get(tokens[position].lower())
        position += 1
        if macro is None:
            written.append(tokens[position - 1])
        elif not macro.parameters:
            written.append(macro.text)
        else:
            arguments, position = _arguments(tokens, position)
            replaced = [expanded(argument, macros) for argument in arguments]
            written.append(macro.applied(replaced))
        if sum(map(len, written)) > LONGEST_EXPANSION:
            raise OverflowError(LONGEST_EXPANSION)
    return "".join(written)


def _arguments(tokens: list[str], position: int) -> tuple[list[str], int]:
    """Return what stands between the parentheses from a position on, and where they end."""
    while position < len(tokens) and tokens[position].isspace():
        position += 1
    if position >= len(tokens) or tokens[position] != "(":
        return [], position
    depth, arguments = 0, [""]
    for index in range(position, len(tokens)):
        token = tokens[index]
        depth += (token == "(") - (token == ")")
        if depth == 0:
            return arguments, index + 1
        if token == "," and depth == 1:
            arguments.append("")
        elif index > position:
            arguments[-1] += token
    return arguments, len(tokens)
