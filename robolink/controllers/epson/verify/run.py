"""One verification, from login to logout.

What cannot be settled by reading, and why. Nothing here talks to the controller.
"""

from dataclasses import replace
from typing import TYPE_CHECKING

from robolink.controllers.epson.controller import EpsonController
from robolink.controllers.epson.line import SERIAL, EpsonLine, open_line
from robolink.controllers.epson.session import log_in
from robolink.controllers.epson.verify import facts
from robolink.controllers.epson.verify.verification import Fact, Interview, Verification
from robolink.journal import memory_journal
from robolink.messages import tr
from robolink.model import ControllerFacts, Secret
from robolink.protocols import spel
from robolink.timing import wall_label
from robolink.transport import DialogueLog, LinkUrl, TraceSink, parse_url

if TYPE_CHECKING:
    from robolink.protocols.epson_binary import Dialect


def not_tried() -> tuple[Fact, ...]:
    """Return the facts that need a motion, a write, an error or a long wait."""
    error = tr("not tried: it would leave the controller in error")
    moving = tr("not tried: something would have to run and be stopped")
    minutes = tr("not tried: it takes minutes")
    setup = tr("cannot be read over the wire: look at the controller's setup")
    monitoring = tr("not tried: no command is sent in that mode")
    disturbing = tr("not tried: it could end this connection")
    writing = tr("not tried: it would change something")
    many = tr("not tried: it takes many readings")
    why_not = (
        (tr("TLSet(n) of an undefined tool"), error, "tlset_of_undefined"),
        (tr("answer to a statement that fails"), error, "execute_failure"),
        (tr("code of that answer"), error, "execute_failure_code"),
        (tr("order of the answers around an Abort"), moving, "abort_reply_first"),
        (tr("a statement whose client vanishes"), moving, "execute_on_disconnect"),
        (tr("Logout while a task runs"), moving, "logout_while_running"),
        (tr("refusal while only monitoring"), monitoring, "monitoring_refusal"),
        (tr("Move ... Till whose input is on already"), moving, "till_already_met"),
        (tr("remote time-out while only monitoring"), minutes, "monitoring_timeout"),
        (tr("a second client"), disturbing, "second_client"),
        (tr("TLClr of the selected tool"), writing, "clear_selected_tool"),
        (tr("XYLim limits the tip or the flange"), writing, "xylim_counts"),
        (
            tr("a failed statement without the error state"),
            error,
            "error_state_after_failed_execute",
        ),
        (tr("Login without a parameter"), disturbing, "login_without_parameter"),
        (tr("a robot's number left out"), writing, "missing_robot_number"),
        (tr("SetCurRobot,0"), writing, "robot_zero"),
        (tr("assignment to a variable"), writing, "variable_assignment"),
        (tr("If ... Then in a statement"), error, "single_line_if"),
        (tr("Accel above 100 percent"), error, "accel_max"),
        (tr("time allowed before the login"), minutes, "login_timeout_s"),
        (tr("remote time-out"), setup, "remote_timeout_s"),
        (tr("noise of the measured position"), many, "real_pos_noise_mm"),
    )
    return tuple(Fact(name, finding, option) for name, finding, option in why_not)


def verify_epson(
    url: str,
    *,
    password: Secret | None = None,
    timeout_s: float = 3.0,
    trace: TraceSink | None = None,
) -> Verification:
    """Find out what a controller does where documents leave it open (docs/reference/epson.md 7).

    Reads only: no value is written, nothing moves, no statement is run that could leave an
    error. While production runs only queries are sent, and less is found out.

    Args:
        url: The controller.
        password: Its remote password.
        timeout_s: Longest wait for one answer.
        trace: Told about all traffic but the login.

    Raises:
        ConfigError: The URL is wrong.
        ConnectError: Nobody is reached.
        LoginRefusedError: Wrong or missing password.

    Example:
        >>> from robolink.controllers.epson.verify import verify_epson
        >>> found = verify_epson("epson+sim://verify-example", timeout_s=1)
        >>> len(found.facts) > 10
        True
    """
    log = DialogueLog(parse_url(url).identity, wall_label())
    traces = (log,) if trace is None else (log, trace)
    line = open_line(_with_every_letter(parse_url(url)), timeout_s=timeout_s, traces=traces)
    session = log_in(line, password, timeout_s=timeout_s)
    try:
        # The run only reads, and the login ensures that no other client is connected.
        outcomes = memory_journal(session.identity).log(session.identity)
        controller = EpsonController(session, outcomes, remote_timeout_s=0.0)
        try:
            about, found = _found_out(
                Interview(controller, session, line.transport, log), _dialect_of(line)
            )
        finally:
            controller.close()
    finally:
        session.close()
    return Verification(session.identity, about, found, log.dialogue)


def _dialect_of(line: EpsonLine) -> "Dialect | None":
    """Return how a serial line is spoken, ``None`` for Remote Ethernet."""
    if not line.outlives_sessions:
        return None
    from robolink.protocols.epson_binary import EpsonBinaryCodec

    return line.codec.dialect if isinstance(line.codec, EpsonBinaryCodec) else None


def _with_every_letter(url: LinkUrl) -> LinkUrl:
    """Try letters that no manual prints: of them only Abort, at rest."""
    if url.medium != SERIAL:
        return url
    return replace(url, options={**url.options, "letters": "guessed"})


def _found_out(
    interview: Interview, dialect: "Dialect | None"
) -> tuple[ControllerFacts, tuple[Fact, ...]]:
    about = interview.controller.facts()
    shown = [
        *(
            _of_remote_ethernet(interview)
            if dialect is None
            else facts.serial_facts(interview, dialect)
        ),
        _served(interview),
        facts.closing_quote(interview),
        facts.number_lead_blank(interview),
        facts.point_coordinates(interview),
        facts.point_flags(interview),
        facts.where_width(interview),
        facts.base(interview),
        facts.comma_blank(interview),
        *facts.tool_facts(interview),
        _while_executing(interview),
    ]
    if dialect is not None:
        interview.log_out()
        return about, (*shown, *not_tried())
    end = (facts.terminator(interview), facts.unfinished_request(interview.leave()))
    return about, (*shown, *end, *not_tried())


def _of_remote_ethernet(interview: Interview) -> tuple[Fact, ...]:
    return (
        facts.status_flags(interview),
        facts.case_echo(interview),
        facts.extended_queries(interview),
        facts.command_set(interview),
        *facts.preferences(interview),
    )


def _served(interview: Interview) -> Fact:
    name = tr("only monitoring")
    query = spel.print_selected_tool()
    answer = interview.printed(query)
    if answer is None:
        return Fact(name, interview.why_no_statement(), "monitoring_only")
    evidence = f"{query} -> {answer}"
    return Fact(name, tr("no: statements are run"), "monitoring_only", False, evidence)


def _while_executing(interview: Interview) -> Fact:
    name, option = tr("flags while a statement runs"), "flags_during_execute"
    flags = interview.flags_while_waiting()
    if flags is None:
        why = interview.why_no_statement() or tr("the statement had ended already")
        return Fact(name, why, option)
    ready = flags.endswith("1")
    finding = tr("Ready stays on") if ready else tr("Running is on, Ready off")
    return Fact(name, finding, option, "ready" if ready else "running", flags)
