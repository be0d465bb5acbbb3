"""solve: calculate a tool offset from a file. Nothing is connected, nothing moves."""

from pathlib import Path

import click

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.pose_tables import NOTHING_SAID, ReadingChoices
from robolink_cli.console.numbers import DECIMAL
from robolink_cli.console.render import emit_json, json_is_on
from robolink_cli.options.pose_source import reading_options
from robolink_cli.options.shared import json_option


@click.command()
@click.argument("file", type=click.Path(dir_okay=False, path_type=Path))
@click.option(
    "--method",
    type=click.Choice(["two_pose", "n_angle", "n_angle_robust", "pivot", "pivot_robust"]),
    help="FILE holds only poses, in any format that 'robolink expert poses show' reads.",
)
@reading_options
@click.option(
    "--sigma",
    "sigma_mm",
    type=DECIMAL,
    metavar="MM",
    help="Standard deviation of one placement, mm.",
)
@click.option(
    "--threshold",
    "threshold_mm",
    type=DECIMAL,
    metavar="MM",
    help="Residual above which a robust method rejects a pose, mm.",
)
@click.option(
    "--accept-residuals",
    is_flag=True,
    help="Do not end with exit code 7 because of large residuals.",
)
@json_option
def solve(
    file: Path,
    method: str | None,
    choices: ReadingChoices,
    sigma_mm: float | None,
    threshold_mm: float | None,
    accept_residuals: bool,
) -> int:
    """Calculate a tool offset from measurements in FILE, offline.

    FILE is JSON: one case with method, units and input, or many under "vectors"; lengths in mm,
    angles in degrees. With --method it is any file of poses. Exit code 7 when a case gives no
    reliable result, or one with residuals beyond tolerance.
    """
    from robolink_cli.commands.measure.solve.answer import (
        exit_code,
        load,
        solve_document,
        table_case,
    )
    from robolink_cli.views.solve import show_case

    if method is not None:
        case = table_case(
            file, method=method, choices=choices, sigma_mm=sigma_mm, threshold_mm=threshold_mm
        )
    elif choices != NOTHING_SAID or (sigma_mm, threshold_mm) != (None, None):
        raise ConfigError(
            tr("--columns, --length, --euler, --sigma and --threshold belong to a file of poses."),
            remedy=tr("Give --method as well, or write the values into the JSON file."),
        )
    else:
        case = load(file)
    document = solve_document(case)
    if json_is_on():
        emit_json("robolink/solve/1", document)
    else:
        results = document.get("results")
        for result in results if isinstance(results, list) else [document]:
            show_case(result)
    return exit_code(document, accept_residuals=accept_residuals)
