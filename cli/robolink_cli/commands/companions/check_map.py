"""plc check-map: whether a map is right, as far as the file, a probe or a person can tell."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from robolink.errors import ConfigError, DeclinedError
from robolink.messages import joined, tr
from robolink.timing import local_label
from robolink_cli.console.render import note, say, table
from robolink_cli.session.context import CliContext, controller_options
from robolink_cli.session.operator_identity import signature_of

if TYPE_CHECKING:
    from robolink.controllers.plc_map import PlcMapController
    from robolink_cli.commands.companions.map_values import MapValues


@click.command("check-map", short_help="Check the map of a PLC's registers.")
@click.argument("file", metavar="[MAP.toml]", required=False, type=click.Path(path_type=Path))
@click.option(
    "--from-csv",
    "register_list",
    metavar="LIST.csv",
    type=click.Path(path_type=Path),
    help="Start a map from a register list, and show it; nothing else is done.",
)
@click.option(
    "--shows",
    multiple=True,
    metavar="TOOL.AXIS=VALUE",
    help="What the HMI shows, for example 1.x=12.35: confirms the map. May be repeated.",
)
@controller_options
def check_map(
    context: CliContext, file: Path | None, register_list: Path | None, shows: tuple[str, ...]
) -> None:
    """Check the map of a PLC's registers: the file, or with -c its values against the HMI.

    Without a probe in the PLC nothing is written before a person has compared the values here.
    """
    if register_list is not None:
        _start(context, register_list)
    elif file is not None:
        _check_file(context, file)
    else:
        _check_values(context, shows)


def _start(context: CliContext, register_list: Path) -> None:
    from robolink.register_maps import draft_from_csv

    draft = draft_from_csv(register_list)
    payload: dict[str, object] = {
        "map": draft.text,
        "found": draft.found,
        "left": list(draft.left),
        "bad": list(draft.bad),
        "notes": list(draft.notes),
    }
    context.emit("plc-map-draft", payload, lambda: say(draft.text.rstrip()))
    for remark in (*draft.notes, *draft.bad):
        note(remark)
    note(
        tr(
            "Components of tools found: {found}. Rows left for you: {left}. Fill in what is "
            "open, then 'robolink expert plc check-map MAP.toml'.",
            found=draft.found,
            left=len(draft.left),
        )
    )


def _check_file(context: CliContext, file: Path) -> None:
    from robolink.register_maps import load_map
    from robolink_cli.commands.companions.map_values import place_rows

    found = load_map(file)
    rows = place_rows(found)
    payload: dict[str, object] = {
        "name": found.name,
        "sha256": found.sha256,
        "places": [dict(zip(("what", "place", "how"), row, strict=True)) for row in rows],
    }

    def show() -> None:
        table(found.name, (tr("what"), tr("place"), tr("how")), rows)
        say(tr("The file is right. With -c its values are compared with the HMI."))

    context.emit("plc-map", payload, show)


def _check_values(context: CliContext, shows: tuple[str, ...]) -> None:
    from robolink.register_maps import confirm, confirmation_of
    from robolink_cli.commands.companions.map_values import MapValues

    with _opened(context) as controller:
        register_map = controller.register_map
        values = MapValues(controller)
        if not context.json:
            values.show()
        controller.require_probe()
        name = controller.who().name
        confirmed = confirmation_of(name, register_map)
        if shows or (register_map.probe is None and confirmed is None):
            compared = _compared(controller, values, shows)
            person = signature_of(context.operator, context.expected, changes=True)
            by = person.operator or person.os_user
            confirmed = confirm(name, register_map, by=by, compared=compared)
    payload = values.payload()
    payload["probe"] = None if register_map.probe is None else "fits"
    payload["confirmed_by"] = confirmed.by if confirmed else None
    payload["confirmed_at"] = confirmed.at if confirmed else None

    def show() -> None:
        if register_map.probe is not None:
            say(tr("The probe reads {value:g}: the map fits.", value=register_map.probe.value))
        if confirmed:
            say(
                tr(
                    "Confirmed by {by} at {at}: {compared}",
                    by=confirmed.by,
                    at=local_label(confirmed.at),
                    compared=confirmed.compared,
                )
            )

    context.emit("plc-map-values", payload, show)


def _compared(controller: "PlcMapController", values: "MapValues", shows: tuple[str, ...]) -> str:
    """Return what was compared; a difference takes an earlier confirmation back."""
    from robolink.register_maps import revoke
    from robolink_cli.commands.companions.map_values import MapDiffersError

    answers = shows or _asked(controller, values)
    try:
        return values.compared(answers)
    except MapDiffersError as error:
        held = revoke(controller.who().name, controller.register_map)
        if held is not None:
            error.remedy = joined(
                " ",
                (
                    tr(
                        "The confirmation by {by} of {at} is taken back.",
                        by=held.by,
                        at=local_label(held.at),
                    ),
                    error.remedy,
                ),
            )
        raise


def _opened(context: CliContext) -> "PlcMapController":
    from robolink.controllers.plc_map import open_plc_map
    from robolink.journal import memory_journal
    from robolink.transport import parse_url

    url = parse_url(context.require_url())
    if url.kind != "plc":
        raise ConfigError(
            tr("{url} is not a PLC with a map.", url=url.identity),
            remedy=tr("Give -c plc+modbus-tcp://192.168.0.2?map=machine.toml, or a map file."),
        )
    # Nothing is written here, so nothing is recorded but the confirmation.
    return open_plc_map(
        url,
        outcomes=lambda identity: memory_journal(identity).log(identity),
        timeout_s=context.timeout_s,
        compare_probe=False,
    )


def _asked(controller: "PlcMapController", values: "MapValues") -> list[str]:
    """Ask what the HMI shows for one value of each form; the PLC's watchdog is kept quiet.

    Raises:
        DeclinedError: Nobody can be asked, or the person does not answer.
    """
    from robolink.runner import POLL_S, Question
    from robolink_cli.prompts.operator import terminal
    from robolink_cli.prompts.questions import on_terminal

    wanted = values.to_compare()
    if not on_terminal():
        raise DeclinedError(
            tr("Nobody has compared this map with the HMI, but there is nobody to ask."),
            remedy=tr(
                "Run it on a terminal, or give what the HMI shows: {options}.",
                options=" ".join(f"--shows {key}=..." for key in wanted),
            ),
        )
    answers = []
    for key in wanted:
        terminal().ask(tr("What does the HMI show for {key}?", key=key), Question.TEXT)
        while (line := terminal().poll(POLL_S)) is None:
            controller.status()
        if line.strip().lower() == "q":
            raise DeclinedError(
                tr("The map is not confirmed."), remedy=tr("Nothing was written; run it again.")
            )
        answers.append(f"{key}={line.strip()}")
    return answers
