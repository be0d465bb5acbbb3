"""Comparing a map's values with the machine's own screen, and keeping on record which were."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from robolink.errors import ConfigError, DeclinedError
from robolink.messages import joined, tr
from robolink.register_maps import (
    ComparedValue,
    MapDiffersError,
    MapValue,
    OpenValue,
    compare,
    compare_test,
    confirm,
    confirmation_of,
    revoke,
    to_compare,
)
from robolink.timing import local_label
from robolink_cli.commands.companions.map_values import MapValues
from robolink_cli.console.render import note
from robolink_cli.prompts.questions import on_terminal
from robolink_cli.session.context import CliContext
from robolink_cli.session.operator_identity import signature_of

if TYPE_CHECKING:
    from robolink.controllers import PlcMapController


class MapComparison:
    """The comparison of one map at one PLC. A difference takes all back that was confirmed."""

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
        """Ask for what is not compared yet; off a terminal, only where nothing is.

        Raises:
            MapDiffersError: A value differs.
            DeclinedError: Nobody can be asked and nothing is compared, or the person ended it.
        """
        if not on_terminal():
            if wanted := self._wanted(values):
                self._require_some(wanted)
            return
        while wanted := self._wanted(values):
            try:
                made = self._asked(wanted[0], values)
            except MapDiffersError as error:
                raise self._taken_back(error) from error
            except ConfigError as error:  # of the answer: it is asked for again
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
                "First enter a test value at the HMI for {values}, and put the old one back "
                "afterwards.",
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
        """Ask for one value; return what was compared, nothing where it was left out."""
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
        except MapDiffersError as error:  # where it went to, the map does not tell
            away = tr("At the HMI, put {key} back to what it was.", key=value)
            error.remedy = joined(" ", (error.remedy, away))
            raise
        except (ConfigError, DeclinedError):
            self._put_back(value, values.found.get(value), now.get(value))
            raise
        self._put_back(value, values.found.get(value), now.get(value))
        return made

    def _given(self, answer: str, value: MapValue) -> bool:
        """Whether there is an answer; one that is left out is not asked for again.

        Raises:
            DeclinedError: The person ended it.
        """
        if answer.lower() == "q":
            raise DeclinedError(
                tr("Not everything was compared."),
                remedy=tr(
                    "What was compared stays on record, and no command changes the rest. Run "
                    "it again to go on."
                ),
            )
        if not answer:
            self._left_out.add(value)
        return bool(answer)

    def _put_back(self, value: MapValue, before: float | None, now: float | None) -> None:
        """Have a test value taken away again, and look whether it was."""
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
                    "{key} still reads {found}: put it right before production.",
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
        return error
