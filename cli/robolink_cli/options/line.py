"""The type of options that take one line of text for the record."""

from typing import TYPE_CHECKING, Final

import click

from robolink.messages import tr
from robolink_cli.console.output import visible

if TYPE_CHECKING:
    _ParamType = click.ParamType[str]
else:
    _ParamType = click.ParamType  # click 8.1 knows no parameter of it

LONGEST: Final = 200
"""Characters, as in recipes."""


class LineType(_ParamType):
    """One line without control characters, refused in the words of recipes."""

    name = "text"

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> str:
        """Return the text.

        Raises:
            BadParameter: It holds a control character or a line break, or is too long.
        """
        text = str(value)
        if visible(text) != text or "\n" in text:
            self.fail(tr("it must not hold control characters or line breaks"), param, ctx)
        if len(text) > LONGEST:
            self.fail(tr("it has more than {most} characters", most=LONGEST), param, ctx)
        return text


LINE: Final = LineType()
