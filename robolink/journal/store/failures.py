"""Errors of the database, turned into errors that say what to do."""

import errno
from typing import Final

from robolink.errors import JournalError
from robolink.messages import joined, listed, tr
from robolink.remedy_words import RemedyWord, remedy_word

_NO_ROOM: Final = {
    code for name in ("ENOSPC", "EDQUOT", "EFBIG") if (code := getattr(errno, name, None))
}
# Result codes of SQLite (https://www.sqlite.org/rescode.html), the low byte.
_SQLITE: Final = {
    3: "forbidden",
    5: "locked",
    6: "locked",
    8: "forbidden",
    10: "disk",
    11: "damaged",
    13: "full",
    14: "forbidden",
    19: "refused",
    26: "foreign",
}
# Classes and codes of PostgreSQL (its manual, appendix A).
_POSTGRESQL: Final = {
    "53100": "full",
    "25006": "denied",
    "42501": "denied",
    "28": "denied",
    "3D": "unreachable",
    "55P03": "locked",
    "40P01": "locked",
    "57": "unreachable",
    "08": "unreachable",
    "58": "disk",
    "XX": "damaged",
    "42": "foreign",
}


def journal_error(error: Exception, name: str, consequence: str, then: str = "") -> JournalError:
    """Return the error to show for an error of the database.

    Args:
        error: As the driver or the system raised it.
        name: Which journal, as a person is told.
        consequence: What it means for the controller, one sentence.
        then: What to do once the journal can be used again; a new one does not know of it.
    """
    reason, text = reason_of(error), " ".join(str(error).split())
    if reason == "damaged":
        return damaged_error(text, name, consequence)
    cause, remedy = _sentences(reason, text)
    return JournalError(
        listed(tr("The journal {name} cannot be used:", name=name), [cause]),
        remedy=joined(" ", filter(None, (consequence, remedy, then))),
    )


def cause_of(error: Exception) -> str:
    """Return what happened to a database, for an error about another one than a journal.

    Args:
        error: As the driver or the system raised it.
    """
    return _sentences(reason_of(error), " ".join(str(error).split()))[0]


def damaged_error(found: str, name: str, consequence: str) -> JournalError:
    """Return the error to show for damage that the database itself did not notice.

    Args:
        found: What was found, one sentence.
        name: Which journal, as a person is told.
        consequence: What it means for the controller, one sentence.
    """
    cause = tr("it is damaged ({text})", text=" ".join(found.split()).rstrip("."))
    return JournalError(
        listed(tr("The journal {name} cannot be used:", name=name), [cause]),
        remedy=joined(" ", filter(None, (consequence, _move_it_away()))),
    )


def reason_of(error: BaseException) -> str:
    """Return what an error of the database, the driver or the system is about; empty for else."""
    if isinstance(error, PermissionError):
        return "forbidden"
    if isinstance(error, UnicodeDecodeError):
        return "damaged"  # a damaged byte in a text, or in the name in SQLite's message
    if isinstance(error, OSError) and error.errno in _NO_ROOM:
        return "full"
    code = getattr(error, "sqlite_errorcode", None)
    if isinstance(code, int):
        return _SQLITE.get(code & 0xFF, "")
    state = getattr(error, "sqlstate", None)
    if isinstance(state, str):
        return _POSTGRESQL.get(state) or _POSTGRESQL.get(state[:2], "")
    # psycopg gives no state if it could not connect at all.
    return "unreachable" if type(error).__module__.startswith("psycopg") else ""


def _sentences(reason: str, text: str) -> tuple[str, str]:
    match reason:
        case "full":
            return tr("the disk is full"), tr("Free space there, then repeat the command.")
        case "disk":
            cause = tr("the disk reported an error ({text})", text=text)
            return cause, tr(
                "Check the disk and its space, or name another place in ROBOLINK_JOURNAL."
            )
        case "forbidden":
            cause = tr("this user may not write or open it ({text})", text=text)
            return cause, tr(
                "Make file and folder writable, or name another place in ROBOLINK_JOURNAL."
            )
        case "locked":
            remedy = tr("Wait until it has finished, or end it; then repeat the command.")
            return tr("another program keeps it locked"), remedy
        case "foreign":
            cause = tr("it is not a journal ({text})", text=text)
            return cause, tr("Move it away, or name another place in ROBOLINK_JOURNAL.")
        case "denied":
            cause = tr("the database does not let this user write ({text})", text=text)
            return cause, tr("Give the user that right, or name another place in ROBOLINK_JOURNAL.")
        case "unreachable":
            cause = tr("the database cannot be reached ({text})", text=text)
            return cause, tr("Check that its server runs, the address, its name and the network.")
        case _:
            return text, tr(
                "Check the file or the database, or name another place in ROBOLINK_JOURNAL."
            )


def _move_it_away() -> str:
    return tr(
        "Save it with {export}, move it away, then check the selected tool and offsets by hand.",
        export=remedy_word(RemedyWord.EXPORT_JOURNAL),
    )
