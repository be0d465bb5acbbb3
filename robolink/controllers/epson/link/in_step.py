"""After the login on a serial line: the answers are those to the questions.

Apart from what opens the line, because a stop does without it.
"""

from robolink.controllers.epson.link.session import EpsonSession
from robolink.errors import RejectedError, RemoteProtocolError, TransportTimeoutError
from robolink.messages import tr


def prove_in_step(session: EpsonSession) -> None:
    """See that an answer belongs to its question, on a line that outlives its sessions.

    No other request is answered with the letter of GetCurRobot, and nothing else asks for it so
    early; so an answer to it can be no late one. It holds a number too, which shows that both
    ends write numbers alike.

    Raises:
        RemoteProtocolError: The answers are not those to the questions, or numbers are written
            in another way.
        TransportError: Nothing comes.
    """
    try:
        session.exchange("GetCurRobot")
    except RejectedError:
        return  # a refusal is an answer to it, too
    except (RemoteProtocolError, TransportTimeoutError) as error:
        error.remedy = tr(
            "Connect again. If it happens twice, the controller writes numbers in another "
            "way: say numbers=ascii_hex in the URL (docs/remote-rs232.md)."
        )
        raise
