"""Judges the open marker of an output, a memory bit or a variable by reading it."""

from robolink.controllers.epson.io.bits import EpsonIo
from robolink.controllers.epson.io.variables import EpsonVariables, equal_values
from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.model import Finding, Marker, Value, Verdict
from robolink.timing import local_label
from robolink.ways import Way, way


class PendingValues:
    """Reads the value that a marker is about; changes nothing."""

    def __init__(self, io: EpsonIo, variables: EpsonVariables) -> None:
        self._io = io
        self._variables = variables

    def examine(self, marker: Marker) -> Finding:
        """Return what became of the request.

        Raises:
            ConfigError: The marker was written by something else.
        """
        kind = ""
        match marker.details.get("item"):
            case ["output", str(bit)]:
                now: Value = self._io.read_output(int(bit))
            case ["memory", str(bit)]:
                now = self._io.read_memory(int(bit))
            case ["variable", str(name), str(kind)]:
                now = self._variables.read(name, kind)
            case _:
                raise ConfigError(
                    tr(
                        "What was left unfinished at {when} cannot be read.",
                        when=local_label(marker.begun_at),
                    ),
                    remedy=tr(
                        "Look at the controller, then {forget}.", forget=way(Way.FORGET_MARKER)
                    ),
                )
        return _finding(marker, now, kind)


def _finding(marker: Marker, now: Value, kind: str) -> Finding:
    before, requested = marker.details.get("before"), marker.details.get("requested")
    if equal_values(now, requested, kind):
        sentence = tr("{request}: the new value {now} is there.", request=marker.request, now=now)
        return Finding(marker, Verdict.DONE, sentence)
    if equal_values(now, before, kind):
        sentence = tr(
            "{request}: the old value {now} is still there.", request=marker.request, now=now
        )
        return Finding(marker, Verdict.NOT_APPLIED, sentence)
    sentence = tr(
        "{request}: {now} is there, neither the old value {before} nor the new one.",
        request=marker.request,
        now=now,
        before=before,
    )
    return Finding(marker, Verdict.CONFLICT, sentence)
