"""EPSON behaviours that no document specifies, as named options; a controller's own texts.

Each default is the likeliest reading; the driver must work with every value (the contract
tests run with each). Evidence marks: [D] document, [R] transcript of a real controller,
[I] inferred, [U] unverified, [open] the references contradict each other.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, make_dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Final, Literal

from robolink.errors import ConfigError
from robolink.files.named import read_named
from robolink.messages import tr
from robolink.protocols.epson_binary import Dialect, Letters, NakCode, Numbers
from robolink_simulators.epson.condition import RefusalKind
from robolink_simulators.option_values import require_known, values_from_text


@dataclass(slots=True)
class ControllerCard:
    """Texts of the extended queries; the values are the simulator's own.

    Source: docs/reference/epson.md 1.8.

    Attributes:
        name: Its name, ``0`` if none was given.
        kind: Its type.
        project: The project in it.
        robot_name: The name of its robot.
        camera: The model of the camera of its vision system.
        force_sensor: The serial number of its force sensor.
        settings: What GetContSettings tells in place of the preferences, if anything.
        messages: Texts of error numbers; the others have texts of the simulator's own.
    """

    name: str = "SIMULATED"
    kind: str = "SIMULATOR"
    project: str = "robolink"
    robot_name: str = "Robot1"
    camera: str = "0"
    force_sensor: str = "0"
    settings: str = ""
    messages: dict[int, str] = field(default_factory=dict)


if TYPE_CHECKING:

    @dataclass(frozen=True, slots=True)
    class SpelNumbers:
        """The fields that are made below, for type checkers."""

        def __init__(self, **numbers: int) -> None: ...

        def __getattr__(self, name: str) -> int: ...

else:
    SpelNumbers = make_dataclass(
        "SpelNumbers",
        [(kind.option, int, kind.value) for kind in RefusalKind],
        frozen=True,
        slots=True,
        namespace={
            "__doc__": "The number of each refusal, by the name of its :class:`RefusalKind`.",
            "__module__": __name__,
        },
    )


@dataclass(frozen=True, slots=True)
class EpsonOptions:
    """The behaviours of one controller.

    Attributes:
        terminator: Line end in force in the controller setup, both ways [D].
        status_flags: GetStatus prints 11 flags (RC+ 7 on) or 10 (RC+ 5) [D].
        print_crlf_inside_quotes: Print's own CRLF stands before the closing quote [R/I].
        abort_reply_first: Abort is answered before the Execute it ends [U].
        second_client: What a second connection meets while a client is logged in [U].
        execute_on_disconnect: Whether a motion goes on when its client vanishes [I].
        logout_while_running: Logout during a task: raises a controller error [D], or is
            also refused.
        execute_failure: How a failed statement is answered [I]: a refusal with
            ``execute_failure_code``, or a quoted text.
        flags_during_execute: What GetStatus shows while an Execute runs [U].
        monitoring_only: Another device starts the cell; only queries are served [D].
        monitoring_refusal: Code that a held-back command gets in that mode [U].
        monitoring_timeout: What the remote time-out does in that mode: it cuts the link only,
            since another device supervises the cell, or it raises error 19 too [U].
        login_timeout_s: Without a login the connection is cut after this [D, RC+ 7].
        remote_timeout_s: Idle time after which error 19 is raised and the link cut; 0 never [D].
        point_coordinates: Stored points print six coordinates, or as many as given [open].
        true_value: What ``Print`` of True shows [open].
        comma_blank: What a comma in Print leaves between items: a blank before numbers, always a
            blank, nothing, a comma and a blank, or a tabulator [open].
        tool_listing: Layout of the TLSet listing [I].
        tlset_of_undefined: What the function TLSet(n) gives for an undefined tool [U].
        where_width: Width of the value field of Where [open].
        requests_end_with_silence: A request may lack its terminator; it ends where the next
            one begins, or when nothing has come for 0.1 s [R, one controller; the time is I].
        blank_before_dollar: A request that begins with a blank is error 10 [D: it does not begin
            with a dollar sign], or its blanks are skipped [U, one client sends it].
        login_without_parameter: What ``$Login`` without a comma is [U, three clients send it].
        missing_robot_number: What SetMotorsOn, SetMotorsOff and Home without a number act on;
            12 is inferred, since the manual lists the number as needed [U].
        robot_zero: What SetCurRobot,0 does, which was seen answered [R; the meaning is U].
        error_state_after_failed_execute: A failed statement leaves the controller in error
            [U: one client resets before it goes on, another does not].
        number_lead_blank: Print shows a blank before a number that begins its text [R, one
            client reads it so].
        accel_max: Highest Accel in percent; AccelMax gives it [D: usually 100, R: 120].
        clear_selected_tool: What TLClr does to the selected tool: it is an error [D], Tool 0 is
            selected, or the number stays selected without a definition [older firmware: U].
        xylim_counts: What XYLim holds inside its limits: the tip of the selected tool, or the
            flange [U].
        reset_outputs_off: Preference "Reset turns off outputs" [D].
        outputs_off_at_estop: Preference "Outputs off at emergency stop" [D; that it is on as
            delivered is assumed].
        dry_run: Preference "Dry run": the robot is not moved, though all answers look as if
            it were [D].
        virtual_io: Preference "Virtual I/O": no input is a real one [D].
        maintenance_data: Preference "Robot maintenance data" [R].
        variable_assignment: ``a=1`` sets a variable of the project, or is refused as for
            programs only [open: one client sends it, the appendix is silent].
        single_line_if: ``If ... Then`` runs, or is refused as the appendix has it [D; one client
            sends it].
        companion: The project holds robolink_tools.prg and its production task calls it [ours].
        extended_queries: Firmware knows GetContVer and its kin; older answers 11 [R].
        rc_plus: Command set: 5, 7 or 8.
        real_pos_noise_mm: Standard deviation of RealPos against the commanded position [R:
            2 um seen].
        till_already_met: What a motion does whose Till holds from the start: it stays, or
            starts and stops at once [open, docs/reference/spel.md 15].
        servo_lag_ms: Time in which the servo makes good two thirds of how far the joints are
            behind their command; Fine waits for the rest [U; 0 is a servo without delay].
        servo_unrest_pulses: By how many pulses the joints stay off their target at rest: Fine
            below it is never met [U; 0 for a servo that is well].
        angle_wrap: Whether a stored tool angle is brought into -180..180 [U].
        statement_us: Simulated time that a statement of a program takes, in microseconds [U].
        loop_passes: Passes of loops of a task without a Wait after which error 2556 is raised
            [D; the count is U].
        for_test: For looks at its end before the first pass, or after it [open].
        integer_overflow: A whole number that a variable cannot hold is an error, or begins
            again at the other end [open].
        undeclared: A name that nobody declared is an error of the build, or a variable of that
            type [open].
        globals_at_start: Start clears global variables that are not preserved [D for the Run
            window], or keeps them.
        background_tasks: Functions that begin as background tasks when the controller starts, with
            commas between [D; that they begin with the controller is I].
        advanced_task_commands: Preference "advanced task commands": programs may say StartMain,
            Cont and Reset Error [D; that it is on is assumed, as samples use all three].
        windows_status: What WindowsStatus tells: 1 for a PC, 2 for RC+, 3 for both [D; that
            neither is connected is assumed].
        input_blank: Where a blank separates the data of Input: between variables, so that the last
            text takes it along [R: a program of a VT6 reads ``reach 100 450 600`` whole into one],
            or everywhere [D, one sentence].
        old_here: ``P*`` is the present position, as in programs of RC+ 3 to 5 [R], or is refused.
        io_bits: Inputs and outputs that the hardware has [D: 512; a fieldbus slave's begin there, a
            fieldbus master's at 6144 in the project files of others, R].
        ports_of_ended_task: A task that ends closes its ports, or leaves them open [U].
        rs232_numbers: How Remote RS232 writes numbers [D in three languages, D otherwise in one].
        rs232_nak_code: How the code of a refusal is written there [U].
        rs232_letters: Which letters are understood: those that a manual prints, or also the
            upper-case twins of readers, v and A [U].
        rs232_status_flags: Flags of GetStatus there [D for RC+ 5; 11 are likely since RC+ 7].
        rs232_word_port_bytes: Length of the number of a port of words there [U].
        rs232_eot_answer: What EOT is answered with [U].
        uncalibrated_robot_result: What RobotX and its kin give without a calibration: an error, or
            0 [open].
        vision_not_found: What VGet does to coordinates of what was not found: it leaves the
            variable alone, or stores 0 [U].
        vision_acquisition_ms: Time of a picture [D: 33 to 66 ms; the value is I].
        vision_object_ms: Time of each object of a sequence [I].
        numbers: Error numbers in use.
    """

    terminator: Literal["crlf", "cr", "lf"] = "crlf"
    status_flags: Literal[11, 10] = 11
    print_crlf_inside_quotes: bool = True
    abort_reply_first: bool = True
    second_client: Literal["ignored", "closed"] = "ignored"
    execute_on_disconnect: Literal["continues", "stops"] = "continues"
    logout_while_running: Literal["error", "refused"] = "error"
    execute_failure: Literal["refusal", "text"] = "refusal"
    execute_failure_code: int = 99
    flags_during_execute: Literal["running", "ready"] = "running"
    monitoring_only: bool = False
    monitoring_refusal: int = 20
    monitoring_timeout: Literal["cut", "error"] = "cut"
    login_timeout_s: float = 300.0
    remote_timeout_s: float = 60.0
    point_coordinates: Literal["six", "given"] = "six"
    true_value: Literal[-1, 1] = -1
    comma_blank: Literal["numeric", "always", "nothing", "comma", "tab"] = "numeric"
    tool_listing: Literal["plain", "padded", "four"] = "plain"
    tlset_of_undefined: Literal["zeros", "error"] = "zeros"
    where_width: Literal[9, 8] = 9
    requests_end_with_silence: bool = True
    blank_before_dollar: Literal["error_10", "skipped"] = "error_10"
    login_without_parameter: Literal["empty_password", "error_12"] = "empty_password"
    missing_robot_number: Literal["error_12", "current", "all"] = "error_12"
    robot_zero: Literal["keeps", "error_12"] = "keeps"
    error_state_after_failed_execute: bool = True
    number_lead_blank: bool = False
    accel_max: int = 120
    clear_selected_tool: Literal["selects_zero", "keeps", "error"] = "error"
    xylim_counts: Literal["tip", "flange"] = "tip"
    reset_outputs_off: bool = True
    outputs_off_at_estop: bool = True
    dry_run: bool = False
    virtual_io: bool = False
    maintenance_data: bool = False
    variable_assignment: Literal["project", "refused"] = "project"
    single_line_if: Literal["refused", "runs"] = "refused"
    companion: bool = True
    extended_queries: bool = True
    rc_plus: Literal[5, 7, 8] = 7
    real_pos_noise_mm: float = 0.002
    till_already_met: Literal["stays", "starts"] = "stays"
    servo_lag_ms: float = 0.0
    servo_unrest_pulses: int = 0
    angle_wrap: bool = False
    statement_us: int = 50
    loop_passes: int = 1_000_000
    for_test: Literal["top", "bottom"] = "top"
    integer_overflow: Literal["error", "wrap"] = "error"
    undeclared: Literal["error", "real", "double"] = "error"
    globals_at_start: Literal["cleared", "kept"] = "cleared"
    background_tasks: str = ""
    advanced_task_commands: bool = True
    windows_status: Literal[0, 1, 2, 3] = 0
    input_blank: Literal["between_variables", "everywhere"] = "between_variables"
    old_here: Literal["refused", "position"] = "refused"
    io_bits: int = 512
    ports_of_ended_task: Literal["closed", "open"] = "closed"
    rs232_numbers: Literal["binary", "ascii_hex"] = "binary"
    rs232_nak_code: Literal["digits", "binary"] = "digits"
    rs232_letters: Literal["documented", "guessed"] = "guessed"
    rs232_status_flags: Literal[10, 11] = 10
    rs232_word_port_bytes: Literal[1, 2] = 1
    rs232_eot_answer: Literal["none", "ack"] = "none"
    uncalibrated_robot_result: Literal["error", "zero"] = "error"
    vision_not_found: Literal["keep", "zero"] = "keep"
    vision_acquisition_ms: int = 40
    vision_object_ms: int = 5
    numbers: SpelNumbers = field(default_factory=SpelNumbers)


PROFILE_SCHEMA: Final = "robolink/epson-profile/1"
_NUMBERS: Final = "numbers."


def serial_dialect(options: EpsonOptions) -> Dialect:
    """Return how a controller with these habits speaks Remote RS232."""
    return Dialect(
        numbers=Numbers(options.rs232_numbers),
        nak_code=NakCode(options.rs232_nak_code),
        letters=Letters(options.rs232_letters),
        status_flags=options.rs232_status_flags,
        word_port_bytes=options.rs232_word_port_bytes,
    )


def option_names() -> tuple[str, ...]:
    """Return every option; error numbers are written ``numbers.NAME``."""
    own = [field.name for field in fields(EpsonOptions) if field.name != "numbers"]
    return (*own, *(_NUMBERS + field.name for field in fields(SpelNumbers)))


def options_from_text(pairs: Mapping[str, str]) -> EpsonOptions:
    """Return the defaults with ``pairs`` applied.

    With ``rc_plus=5`` GetStatus prints 10 flags, unless ``status_flags`` says otherwise.

    Raises:
        ConfigError: An option is unknown, or a value does not fit it.
    """
    return _options(tuple(sorted(pairs.items())))


@lru_cache(maxsize=64)
def _options(in_order: tuple[tuple[str, str], ...]) -> EpsonOptions:
    """Return the shared object for these options: thousands of a fleet have the same."""
    pairs = dict(in_order)
    if pairs.get("rc_plus") == "5":
        pairs.setdefault("status_flags", "10")
    require_known(pairs, option_names(), kind="EPSON")
    numbers = values_from_text(SpelNumbers, pairs, prefix=_NUMBERS)
    own = values_from_text(EpsonOptions, pairs)
    return replace(EpsonOptions(), **own, numbers=replace(SpelNumbers(), **numbers))


def read_profile(path: Path) -> Mapping[str, str]:
    """Return the options of a cell profile as text; unknown ones are absent.

    Names and values are checked where the options are made.

    Raises:
        ConfigError: The file cannot be read, or is no profile.
    """
    try:
        document = json.loads(read_named(path))
        if document["schema"] != PROFILE_SCHEMA:
            raise ValueError(document["schema"])
        return {str(name): str(value) for name, value in document["options"].items()}
    except (OSError, AttributeError, KeyError, RecursionError, TypeError, ValueError) as error:
        raise ConfigError(
            tr("{path} is not a cell profile.", path=path),
            remedy=tr(
                "Give a file that 'robolink expert verify-controller --profile' has written."
            ),
        ) from error
