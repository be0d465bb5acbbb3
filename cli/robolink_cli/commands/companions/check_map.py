"""plc check-map: whether a map is right, as far as the file, a probe or a person can show."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import click

from robolink.errors import ConfigError, DeclinedError, RobolinkError
from robolink.messages import joined, tr
from robolink.model import json_fields
from robolink.register_maps import (
    COMPONENTS,
    AnyMap,
    ComparedValue,
    MapDiffersError,
    MapDraft,
    MapValue,
    OpenValue,
    SymbolMap,
    compare,
    compare_test,
    confirm,
    confirmation_of,
    revoke,
    to_compare,
    values_of,
)
from robolink.timing import local_label
from robolink_cli.console.person import person_here
from robolink_cli.console.render import emit, json_is_on, note, say, table
from robolink_cli.options.declaration import CliArgument, CliOption
from robolink_cli.session.context import CliContext, controller_options
from robolink_cli.session.operator_identity import signature_of

if TYPE_CHECKING:
    from robolink.controllers import PlcMapController


@click.command("check-map", short_help="Check the map of a PLC's registers or symbols.")
@controller_options
def check_map(
    context: CliContext,
    *,
    file: Annotated[
        Path | None, click.Path(path_type=Path), CliArgument(metavar="[MAP.toml]")
    ] = None,
    register_list: Annotated[
        Path | None,
        click.Path(path_type=Path),
        CliOption(
            "--from-csv",
            metavar="LIST.csv",
            help="Draft a map from a register list and show it. Does nothing else.",
        ),
    ] = None,
    browse: Annotated[
        str | None,
        CliOption(
            "--browse",
            metavar="NODE",
            help="Draft a map from what the OPC UA server of -c has below a node; / is all of it.",
        ),
    ] = None,
    shows: Annotated[
        tuple[str, ...],
        CliOption(
            metavar="TOOL.AXIS=VALUE",
            help="What the HMI shows, for example 1.x=12.35: confirms that value. May be repeated.",
        ),
    ] = (),
) -> None:
    """Check the map of a PLC's registers or symbols: the file, or with -c its values at the HMI.

    robolink changes only values that somebody has compared here. One value of each component and
    one of each tool are enough; a component that is 0 needs a test value.
    """
    if register_list is not None:
        _start(register_list)
    elif browse is not None:
        _browse(context, browse)
    elif file is not None:
        _check_file(file)
    else:
        _check_values(context, shows)


def _start(register_list: Path) -> None:
    from robolink.register_maps import draft_from_csv

    _show_draft(draft_from_csv(register_list))


def _browse(context: CliContext, node: str) -> None:
    from robolink.controllers import browse_nodes, draft_from_nodes
    from robolink.transport import open_opcua, parse_url
    from robolink_cli.session.connection import password_of, say_how_protected

    url = parse_url(context.require_url())
    if (url.kind, url.medium) != ("plc", "opcua"):
        raise ConfigError(
            tr("{url} is not a PLC with an OPC UA server.", url=url.identity),
            remedy=tr("Give -c plc+opcua://192.168.0.2:4840."),
        )
    options = {name: said for name, said in url.options.items() if name not in _OF_THE_DRIVER}
    client = open_opcua(
        replace(url, options=options), timeout_s=context.timeout_s, password=password_of(context)
    )
    try:
        say_how_protected(context.require_url())
        found = browse_nodes(client, node)
    finally:
        client.close()
    _show_draft(draft_from_nodes(url.host, found))


_OF_THE_DRIVER: Final = ("map", "simulated")
"""Options of a URL that are not the client's."""


def _show_draft(draft: MapDraft) -> None:
    payload = {"map": draft.text, **json_fields(draft, "found", "left", "bad", "notes")}
    emit("plc-map-draft", payload, lambda: say(draft.text.rstrip()))
    for remark in (*draft.notes, *draft.bad):
        note(remark)
    note(
        tr(
            "Tool components found: {found}. Left for you: {left}. Fill in the rest, "
            "then: robolink expert plc check-map MAP.toml",
            found=draft.found,
            left=len(draft.left),
        )
    )


def _check_file(file: Path) -> None:
    from robolink.register_maps import load_plc_map

    found = load_plc_map(file)
    rows = place_rows(found)
    payload: dict[str, object] = {
        "name": found.name,
        "sha256": found.sha256,
        "places": [dict(zip(("what", "place", "how"), row, strict=True)) for row in rows],
    }

    def show() -> None:
        table(found.name, (tr("what"), tr("place"), tr("how")), rows)
        say(tr("The file is valid. To compare its values with the HMI, add -c."))

    emit("plc-map", payload, show)
    _note_half_written(found)


def _check_values(context: CliContext, shows: tuple[str, ...]) -> None:

    with _opened(context) as controller:
        register_map = controller.register_map
        values = MapValues(controller)
        if not json_is_on():
            values.show()
        _note_half_written(register_map)
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
            say(tr("The probe reads {value:g}, as expected.", value=register_map.probe.value))
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
                    "Not compared yet, so robolink does not change them: {values}.",
                    values=", ".join(map(str, missing)),
                )
            )

    emit("plc-map-values", payload, show)


def _opened(context: CliContext) -> "PlcMapController":
    from robolink.controllers import open_plc_map
    from robolink.journal import memory_journal
    from robolink.transport import parse_url
    from robolink_cli.session.connection import password_of, say_how_protected

    url = parse_url(context.require_url())
    if url.kind != "plc":
        raise ConfigError(
            tr("{url} is not a PLC with a map.", url=url.identity),
            remedy=tr("Give -c plc+modbus-tcp://192.168.0.2?map=machine.toml, or a map file."),
        )
    say_how_protected(context.require_url())
    # Nothing is written here, so only the confirmation is recorded.
    return open_plc_map(
        url,
        outcomes=lambda identity: memory_journal(identity).log(identity),
        timeout_s=context.timeout_s,
        compare_probe=False,
        password=password_of(context) if url.medium == "opcua" else None,
    )


def _note_half_written(found: AnyMap) -> None:
    """Say which tools the machine may use while only a part of them has arrived."""
    if isinstance(found, SymbolMap) and found.half_written:
        note(
            tr(
                "Without a handshake the machine may work with a half-written tool for a moment: "
                "{tools}. Let the PLC take values over on a signal ([commit]), or write only while "
                "the machine stands.",
                tools=", ".join(map(str, found.half_written)),
            )
        )


class MapValues:
    """The present contents of the tools' registers; reads only.

    Attributes:
        found: By value, mm or degrees.
        unreadable: For each tool that cannot be read, why.
    """

    def __init__(self, controller: "PlcMapController") -> None:
        self._map = controller.register_map
        self.found: dict[MapValue, float] = {}
        self.unreadable: dict[int, str] = {}
        for tool in controller.tools.indices():
            try:
                offset = controller.tools.read(tool)
            except RobolinkError as error:
                self.unreadable[tool] = str(error)
                continue
            held = dict(zip(COMPONENTS, offset.components(), strict=True)) if offset else {}
            mapped = self._map.slots[tool].components
            self.found |= {MapValue(tool, name): held[name] for name in mapped if held}

    def payload(self) -> dict[str, object]:
        """Return it as plain JSON; lengths in mm, angles in degrees."""
        return {
            "name": self._map.name,
            "sha256": self._map.sha256,
            "values": {str(value): found for value, found in self.found.items()},
            "unreadable": {str(tool): why for tool, why in self.unreadable.items()},
        }

    def show(self) -> None:
        """Show it to a person at the HMI."""
        rows = [
            [
                str(value),
                number.place,
                number.type,
                f"{self.found[value]:.4f}" if value in self.found else "-",
            ]
            for value, number in values_of(self._map).items()
        ]
        columns = (tr("tool"), tr("place"), tr("type"), tr("mm or deg"))
        table(tr("{name}: what the map finds", name=self._map.name), columns, rows)
        for why in self.unreadable.values():
            note(why)


def place_rows(register_map: AnyMap) -> list[list[str]]:
    """Return which value is where, every number given both ways."""
    rows = []
    for slot in register_map.slots.values():
        for name, number in slot.components.items():
            rows.append([f"{slot.tool}.{name}", number.place, number.form])
        if slot.defined is not None:
            rows.append([tr("{tool} defined", tool=slot.tool), slot.defined.place, ""])
    rows += [[f"flange.{name}", n.place, n.form] for name, n in register_map.flange.items()]
    if register_map.probe is not None:
        number = register_map.probe.number
        rows.append([tr("probe"), number.place, f"{register_map.probe.value:g}, {number.form}"])
    commit = register_map.commit
    named = (
        (tr("request"), commit.request),
        (tr("answer"), commit.answer),
        (tr("busy"), commit.busy),
        (tr("error"), commit.error),
        (tr("error code"), commit.error_code),
        (tr("tool number"), commit.tool_number),
        (tr("permit"), register_map.permit),
        (tr("selected tool"), register_map.selected),
    )
    rows += [[what, place.place, ""] for what, place in named if place is not None]
    rows += [
        [tr("input {number}", number=one.number), one.signal.place, one.name]
        for one in register_map.inputs.values()
    ]
    return rows


class MapComparison:
    """The comparison of one map at one PLC. A difference withdraws all confirmations."""

    def __init__(self, context: CliContext, controller: "PlcMapController") -> None:
        self._controller = controller
        self._map = controller.register_map
        self._name = controller.who().name
        self._context = context
        self._left_out: set[MapValue] = set()

    def of_answers(self, values: MapValues, answers: Sequence[str]) -> None:
        """Compare values with what the HMI shows, all or none of them.

        Raises:
            MapDiffersError: One differs.
            ConfigError: An answer cannot be understood, or tells nothing about the map.
        """
        try:
            made = [self._compared(values, answer) for answer in answers]
        except MapDiffersError as error:
            raise self._taken_back(error) from error
        self._keep(made)

    def of_what_is_missing(self, values: MapValues) -> None:
        """Ask for values that are not yet compared; off a terminal, only if there are none.

        Raises:
            MapDiffersError: A value differs.
            DeclinedError: Nobody can be asked and nothing is compared, or the person ended it.
        """
        if not person_here():
            if wanted := self._wanted(values):
                self._require_some(wanted)
            return
        while wanted := self._wanted(values):
            try:
                made = self._asked(wanted[0], values)
            except MapDiffersError as error:
                raise self._taken_back(error) from error
            except ConfigError as error:  # an invalid answer: ask again
                note(str(error))
            else:
                self._keep(made)
            values = MapValues(self._controller)

    def _compared(self, values: MapValues, answer: str) -> ComparedValue:
        key, _, shown = answer.partition("=")
        return compare(self._map, values.found, MapValue.named(key, self._map), shown)

    def _wanted(self, values: MapValues) -> list[OpenValue]:
        held = confirmation_of(self._name, self._map)
        wanted = to_compare(self._map, values.found, held.compared if held else {})
        return [one for one in wanted if one.value not in self._left_out]

    def _require_some(self, wanted: Sequence[OpenValue]) -> None:
        if confirmation_of(self._name, self._map) is not None:
            return
        tests = [one for one in wanted if one.why_not]
        entering = [
            tr(
                "First enter a test value at the HMI for {values}; afterwards restore the old one.",
                values=", ".join(str(one.value) for one in tests),
            )
        ]
        raise DeclinedError(
            tr("Nobody has compared this map with the HMI, but there is nobody to ask."),
            remedy=joined(
                " ",
                (
                    tr(
                        "Run it on a terminal, or give what the HMI shows: {options}.",
                        options=" ".join(f"--shows {one.value}=..." for one in wanted),
                    ),
                    *(entering if tests else ()),
                ),
            ),
        )

    def _asked(self, wanted: OpenValue, values: MapValues) -> list[ComparedValue]:
        """Ask for one value; return what was compared, nothing if it was left out."""
        value, test = wanted.value, wanted.test_mm_or_deg
        if test is None:
            answer = self._answer(
                tr("What does the HMI show for {key}? (Enter skips it, q ends)", key=value)
            )
            return (
                [compare(self._map, values.found, value, answer)]
                if self._given(answer, value)
                else []
            )
        note(wanted.why_not)
        answer = self._answer(
            tr(
                "Enter {test:g} for {key} at the HMI, let the machine accept it, then type here "
                "what you entered. (Enter skips it, q ends)",
                key=value,
                test=test,
            )
        )
        now = MapValues(self._controller).found
        try:
            made = []
            if self._given(answer, value):
                made = [compare_test(self._map, values.found, now, value, answer)]
        except MapDiffersError as error:  # the map does not show where the write went
            error.advise(tr("At the HMI, put {key} back to what it was.", key=value))
            raise
        except (ConfigError, DeclinedError):
            self._put_back(value, values.found.get(value), now.get(value))
            raise
        self._put_back(value, values.found.get(value), now.get(value))
        return made

    def _given(self, answer: str, value: MapValue) -> bool:
        """Return whether there is an answer; one that is left out is not asked for again.

        Raises:
            DeclinedError: The person ended it.
        """
        if answer.lower() == "q":
            raise DeclinedError(
                tr("Not everything was compared."),
                remedy=tr(
                    "The comparisons made are recorded; robolink does not change the rest. Run "
                    "the command again to continue."
                ),
            )
        if not answer:
            self._left_out.add(value)
        return bool(answer)

    def _put_back(self, value: MapValue, before: float | None, now: float | None) -> None:
        """Let a person remove a test value, and check that it is gone."""
        if now == before:
            return
        self._answer(
            tr(
                "At the HMI, put {key} back to {before}, then press Enter.",
                key=value,
                before=before,
            )
            if before is not None
            else tr("At the HMI, clear {key} again, then press Enter.", key=value)
        )
        left = MapValues(self._controller).found.get(value)
        if left != before:
            note(
                tr(
                    "{key} still reads {found}: correct it before production.",
                    key=value,
                    found=left,
                )
            )

    def _answer(self, question: str) -> str:
        """Ask at the terminal; the PLC's watchdog is kept quiet meanwhile."""
        from robolink.runner import POLL_S, Question
        from robolink_cli.prompts.operator import terminal

        terminal().ask(question, Question.TEXT)
        while (line := terminal().poll(POLL_S)) is None:
            self._controller.status()
        return line.strip()

    def _keep(self, made: Sequence[ComparedValue]) -> None:
        person = signature_of(self._context.operator, self._context.expected, changes=True)
        by = person.operator or person.os_user
        confirm(self._name, self._map, by=by, compared=made)

    def _taken_back(self, error: MapDiffersError) -> MapDiffersError:
        held = revoke(self._name, self._map)
        if held is not None:
            error.say_what_stands(
                tr(
                    "The confirmation by {by} of {at} is withdrawn.",
                    by=held.by,
                    at=local_label(held.at),
                )
            )
        return error
