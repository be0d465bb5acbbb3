"""The commands eye look and eye collect, declared. What they do is imported when they are used."""

from pathlib import Path
from typing import Annotated

import click

from robolink.messages import tr
from robolink_cli.commands.measure.eye.options import EyeOptions
from robolink_cli.options.consent import Overwrite
from robolink_cli.options.declaration import CliArgument, CliOption
from robolink_cli.session.context import CliContext, optional_controller


@click.group()
def eye() -> None:
    """See what robolink finds in a camera's picture; collect pictures for tests. Moves nothing."""


@eye.command("look", short_help="Take one picture and show everything that is found in it.")
@optional_controller
def look(
    context: CliContext,
    *,
    which: EyeOptions,
    out: Annotated[
        Path | None,
        CliOption(
            metavar="FILE",
            help="Write the picture with all circles to this file, .html or .png.",
        ),
    ] = None,
    force: Overwrite = False,
    every: Annotated[
        bool, CliOption("--all", help="List every circle that was refused, not the best few only.")
    ] = False,
    watch: Annotated[
        bool, CliOption(help="Take pictures until Ctrl-C, a line for each: for focusing.")
    ] = False,
    count: Annotated[
        int | None,
        click.IntRange(1, 100_000),
        CliOption(metavar="N", help="With --watch: end after N pictures."),
    ] = None,
) -> int:
    """Take one picture and show everything that is found in it.

    The best candidates are listed with place, radius and edge width, and why each was refused;
    --all, --json and the page of --out have all of them. Exit code 1 where not exactly one tip is
    accepted.
    """
    from robolink_cli.commands.measure.eye.look import look_once
    from robolink_cli.commands.measure.eye.watch import watch_on

    if count is not None and not watch:
        raise click.UsageError(tr("--count needs --watch."))
    if watch:
        if out is not None:
            raise click.UsageError(tr("--watch writes no file: leave out --out."))
        return watch_on(context, which, count)
    return look_once(context, which, out, force=force, every=every)


@eye.command("collect", short_help="Save a picture with its truth marked by hand, for tests.")
@optional_controller
def collect(
    context: CliContext,
    *,
    folder: Annotated[Path, CliArgument(type=click.Path(path_type=Path), metavar="FOLDER")],
    which: EyeOptions,
    truth: Annotated[
        tuple[str, ...],
        CliOption(
            metavar="X,Y,R",
            help="Middle and radius of the tip in pixels, as you see it; once for each tip. "
            "Default: asks.",
        ),
    ] = (),
    no_tip: Annotated[bool, CliOption(help="No whole tip is in the picture.")] = False,
) -> None:
    """Save a picture with its truth marked by hand, for tests of the finder.

    You mark the tip before robolink shows what it found, so that your mark is your own. The
    folder is read by the tests: ROBOLINK_EYE_PICTURES=FOLDER pytest tests/eye
    """
    from robolink_cli.commands.measure.eye.collect import collect_one

    if truth and no_tip:
        raise click.UsageError(tr("--truth and --no-tip contradict each other."))
    collect_one(context, folder, which, truth, no_tip=no_tip)
