"""What the requests and their answers show. Legal at any time, production included."""

import re
from typing import Final

from robolink.controllers.epson.verify.interview import Interview
from robolink.controllers.epson.verify.verification import Fact
from robolink.errors import RemoteProtocolError
from robolink.messages import tr
from robolink.protocols.epson_text import ErrorCode, Preference, parse_preferences

_STATUS: Final = re.compile(rb"#GetStatus,[01]+,[0-9]{4}(\r\n|\r|\n)")
_TERMINATORS: Final = {b"\r\n": "crlf", b"\r": "cr", b"\n": "lf"}
_COMMAND_SETS: Final = (5, 7, 8)


def status_flags(interview: Interview) -> Fact:
    """How many flags GetStatus prints (docs/reference/epson.md 1.4)."""
    name = tr("flags in GetStatus")
    fields = interview.ask("GetStatus")
    if isinstance(fields, int) or len(fields[0]) not in (10, 11):
        return Fact(name, tr("neither 10 nor 11"), "status_flags")
    count = len(fields[0])
    return Fact(name, tr("{count}", count=count), "status_flags", count, ",".join(fields))


def case_echo(interview: Interview) -> Fact:
    """Whether an answer repeats the name as it was written (docs/reference/epson.md 1.1)."""
    echoed = interview.echo("getstatus")
    same = tr("as it was written") if echoed == "getstatus" else tr("in a spelling of its own")
    return Fact(tr("name in an answer"), same, evidence=f"$getstatus -> #{echoed}")


def extended_queries(interview: Interview) -> Fact:
    """Whether the firmware knows GetContVer and its kin (docs/reference/epson.md 1.8)."""
    name, option = tr("extended queries"), "extended_queries"
    answer = interview.ask("GetContVer")
    if not isinstance(answer, int):
        return Fact(name, tr("known"), option, True, f"GetContVer -> {','.join(answer)}")
    if answer == ErrorCode.UNKNOWN_COMMAND:
        return Fact(name, tr("unknown"), option, False, f"GetContVer -> {answer}")
    return Fact(name, tr("refused with code {code}", code=answer), option)


def command_set(interview: Interview) -> Fact:
    """Which RC+ the commands belong to, from the version or the alarms.

    Source: docs/reference/epson.md 1.9.
    """
    name, option = tr("command set of RC+"), "rc_plus"
    version = interview.ask("GetContVer")
    if not isinstance(version, int):
        shown = ",".join(version).strip()
        major = shown.partition(".")[0]
        if major.isdecimal() and int(major) in _COMMAND_SETS:
            return Fact(name, major, option, int(major), f"GetContVer -> {shown}")
    alarms = interview.ask("GetAlm")
    if alarms == ErrorCode.UNKNOWN_COMMAND:
        return Fact(name, tr("5: no alarms yet"), option, 5, f"GetAlm -> {alarms}")
    return Fact(name, tr("7 or 8: the firmware does not say its version"), option)


def preferences(interview: Interview) -> tuple[Fact, ...]:
    """The preferences that matter for tools (docs/reference/epson.md 1.11)."""
    names = {
        Preference.RESET_OUTPUTS_OFF: (tr("Reset switches outputs off"), "reset_outputs_off"),
        Preference.OUTPUTS_OFF_AT_ESTOP: (
            tr("an emergency stop switches outputs off"),
            "outputs_off_at_estop",
        ),
        Preference.DRY_RUN: (tr("dry run"), "dry_run"),
        Preference.VIRTUAL_IO: (tr("virtual I/O"), "virtual_io"),
        Preference.MAINTENANCE_DATA: (tr("maintenance data"), "maintenance_data"),
    }
    answer = interview.ask("GetContSettings")
    if isinstance(answer, int):
        why = tr("this firmware does not tell its preferences: look at the controller's setup")
        return tuple(Fact(name, why, option) for name, option in names.values())
    told = ",".join(answer)
    try:
        on = parse_preferences(told)
    except RemoteProtocolError as error:
        return tuple(Fact(name, error.what, option) for name, option in names.values())
    return tuple(
        Fact(
            name,
            tr("on") if preference in on else tr("off"),
            option,
            preference in on,
            f"GetContSettings -> {told}",
        )
        for preference, (name, option) in names.items()
    )


def terminator(interview: Interview) -> Fact:
    """Which line end the controller sends (docs/reference/epson.md 1.1)."""
    name, option = tr("line end"), "terminator"
    ends = {match[1] for match in _STATUS.finditer(interview.heard)}
    if len(ends) != 1:
        return Fact(name, tr("not the same in every answer"), option)
    (end,) = ends
    return Fact(name, _TERMINATORS[end].upper(), option, _TERMINATORS[end], repr(end)[1:])


def unfinished_request(early: bool | None) -> Fact:
    """Whether a request without its line end is served (docs/reference/epson.md 1.1)."""
    name, option = tr("request without its line end"), "requests_end_with_silence"
    if early is None:
        return Fact(name, tr("not tried: Logout could stop a program"), option)
    finding = tr("is answered") if early else tr("is waited for")
    evidence = "$Logout -> #Logout" if early else tr("no answer within half a second")
    return Fact(name, finding, option, early, evidence)
