"""What Remote RS232 leaves open, asked at rest (docs/reference/epson.md 2)."""

from typing import Final

from robolink.controllers.epson.verify.interview import Interview
from robolink.controllers.epson.verify.verification import Fact
from robolink.messages import tr
from robolink.protocols.epson_binary import Dialect
from robolink.protocols.epson_text import ErrorCode

_NO_SUCH_BIT: Final = "65535"
_CODES: Final = range(ErrorCode.NO_DOLLAR, ErrorCode.SYSTEM + 1)


def serial_facts(interview: Interview, dialect: Dialect) -> tuple[Fact, ...]:
    """Find out which frames and letters this controller takes.

    Args:
        interview: Asks it.
        dialect: As the line was opened.
    """
    return (
        _numbers(interview, dialect),
        _status_flags(interview),
        _nak_code(interview, dialect),
        _abort(interview),
        *_not_asked(),
    )


def _numbers(interview: Interview, dialect: Dialect) -> Fact:
    """Both ends write them alike, else the line would not have been opened."""
    answer = interview.ask("GetCurRobot")
    evidence = f"GetCurRobot -> {answer if isinstance(answer, int) else ','.join(answer)}"
    name, value = tr("numbers on the serial line"), dialect.numbers.value
    return Fact(name, value, "rs232_numbers", value, evidence)


def _status_flags(interview: Interview) -> Fact:
    name, option = tr("flags in GetStatus"), "rs232_status_flags"
    fields = interview.ask("GetStatus")
    if isinstance(fields, int):
        return Fact(name, tr("refused with code {code}", code=fields), option)
    count = len(fields[0])
    return Fact(name, tr("{count}", count=count), option, count, ",".join(fields))


def _nak_code(interview: Interview, dialect: Dialect) -> Fact:
    """A bit that no controller has is refused; the code shows how codes are written."""
    name = tr("code of a refusal")
    code = interview.ask("GetIO", _NO_SUCH_BIT)
    if not isinstance(code, int):
        return Fact(name, tr("not seen: bit {bit} exists", bit=_NO_SUCH_BIT), "rs232_nak_code")
    evidence = f"GetIO {_NO_SUCH_BIT} -> {code}"
    if code not in _CODES:
        finding = tr("makes no sense: say nak_code=digits in the URL")
        return Fact(name, finding, "rs232_nak_code", evidence=evidence)
    return Fact(name, dialect.nak_code.value, "rs232_nak_code", dialect.nak_code.value, evidence)


def _abort(interview: Interview) -> Fact:
    """With nothing running there is nothing that Abort could end."""
    name, option = tr("letter A for Abort"), "rs232_letters"
    if why := interview.why_no_statement():
        return Fact(name, tr("not tried: {why}", why=why), option)
    answer = interview.ask("Abort")
    if not isinstance(answer, int):
        return Fact(name, tr("is understood: letters=guessed"), option, "guessed", "A -> ACK")
    finding = tr("is not understood: movements stay refused on this line")
    return Fact(name, finding, option, "documented", f"A -> NAK {answer}")


def _not_asked() -> tuple[Fact, ...]:
    ports = tr("not tried: a wrong length is an error that cannot be told from others")
    opening = tr("not seen: any answer to EOT is thrown away")
    return (
        Fact(tr("number of a port of words"), ports, "rs232_word_port_bytes"),
        Fact(tr("answer to EOT"), opening, "rs232_eot_answer"),
    )
