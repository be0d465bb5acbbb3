"""calibrate METHOD: measure a tool offset, propose it, write it, test it.

Every method runs in one frame (``measuring``): plan and limits, consent, measurement, proposal with
interval and verdict, question, write, proof, report. A method only says how it measures, and its
command is made from what it declares (``method_command``).
"""

import click

from robolink.messages import declared, spoken
from robolink.methods import find_method, method_names
from robolink_cli.console.help_pages import in_language
from robolink_cli.lazy_group import LazyGroup


class MethodGroup(LazyGroup):
    """The commands of all calibration methods, made when one is used."""

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002 - click's form
        """Return the names of the methods."""
        return list(method_names())

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:  # noqa: ARG002 - click's form
        """Return the command of a method, or while listing its stand-in."""
        if cmd_name not in method_names():
            return None
        method = find_method(cmd_name)
        if self.listing:
            return click.Command(cmd_name, short_help=spoken(method.summary))
        from robolink_cli.commands.measure.calibrate.method_command import command_of

        return in_language(command_of(method))


@click.group(
    cls=MethodGroup,
    lazy={},
    help=declared("Measure where a tool's tip is, propose the offset, write it and test it."),
)
def calibrate() -> None:
    """Root of the methods."""
