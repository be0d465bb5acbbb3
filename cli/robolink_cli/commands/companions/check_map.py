"""plc check-map: whether a map is right, as far as the file, a probe or a person can tell."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.timing import local_label
from robolink_cli.console.render import note, say, table
from robolink_cli.session.context import CliContext, controller_options

if TYPE_CHECKING:
    from robolink.controllers import PlcMapController


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
    help="What the HMI shows, for example 1.x=12.35: confirms that value. May be repeated.",
)
@controller_options
def check_map(
    context: CliContext, file: Path | None, register_list: Path | None, shows: tuple[str, ...]
) -> None:
    """Check the map of a PLC's registers: the file, or with -c its values against the HMI.

    No command changes a value that nobody has compared here. One value of each component and one
    of each tool are enough; a component that is 0 needs a test value.
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
    from robolink.register_maps import confirmation_of
    from robolink_cli.commands.companions.map_comparison import MapComparison
    from robolink_cli.commands.companions.map_values import MapValues

    with _opened(context) as controller:
        register_map = controller.register_map
        values = MapValues(controller)
        if not context.json:
            values.show()
        controller.require_probe()
        comparison = MapComparison(context, controller)
        if shows:
            comparison.of_answers(values, shows)
        else:
            comparison.of_what_is_missing(values)
        confirmed = confirmation_of(controller.who().name, register_map)
    missing = confirmed.missing(register_map) if confirmed else []
    payload = values.payload()
    payload["probe"] = None if register_map.probe is None else "fits"
    payload["confirmed_by"] = confirmed.by if confirmed else None
    payload["confirmed_at"] = confirmed.at if confirmed else None
    payload["compared"] = [str(one) for one in confirmed.compared.values()] if confirmed else []
    payload["not_compared"] = [str(value) for value in missing]

    def show() -> None:
        if register_map.probe is not None:
            say(tr("The probe reads {value:g}, as it should.", value=register_map.probe.value))
        if confirmed:
            say(
                tr(
                    "Confirmed by {by} at {at}: {compared}",
                    by=confirmed.by,
                    at=local_label(confirmed.at),
                    compared=", ".join(map(str, confirmed.compared.values())),
                )
            )
        if missing:
            say(
                tr(
                    "Not compared yet, so no command changes them: {values}.",
                    values=", ".join(map(str, missing)),
                )
            )

    context.emit("plc-map-values", payload, show)


def _opened(context: CliContext) -> "PlcMapController":
    from robolink.controllers import open_plc_map
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
