"""The code page of SPEL+ programs: named by a person, or found out and told."""

import codecs
from typing import Annotated, Final

import click

from robolink.messages import tr
from robolink_cli.console.render import note
from robolink_cli.options.declaration import CliOption

_PLAIN: Final = frozenset({"utf-8", "utf-8-sig"})


class _Encoding(click.ParamType[str]):
    """A code page that Python knows."""

    name = "encoding"

    def convert(self, value: str, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Return the name, or refuse it."""
        try:
            codecs.lookup(value)
        except LookupError:
            self.fail(
                tr("There is no code page {name}. Examples: gbk, cp932, cp1250.", name=value),
                param,
                ctx,
            )
        return value


Encoding = Annotated[
    str | None,
    _Encoding(),
    CliOption(
        metavar="NAME",
        help="Code page of the files: utf-8, gbk, cp932, cp1250. Without it, the first of UTF-8, "
        "cp932 and GBK that fits is used, and named.",
    ),
]


def tell_encoding(taken: str | None, *, named: str | None) -> None:
    """Say which code page was taken, where nobody named it and the text may look wrong."""
    if named is not None or taken in _PLAIN:
        return
    if taken is None:
        note(
            tr(
                "No code page fits all files, so letters that are not ASCII may look wrong. Name "
                "the code page with --encoding."
            )
        )
        return
    note(
        tr(
            "The files were read as {encoding}. If their text looks wrong, name another code page "
            "with --encoding.",
            encoding=taken,
        )
    )
