"""Stops before anything else is read.

No journal, no lease, no question, no click: what these have to say is said afterwards. Of the
cell file only the address and the place of the password are read. A process of this computer
that has the controller is asked to stop it, where it is the only one who can; a Modbus server
serves several clients, so there the stop goes out directly and that process hears of it then.
"""

import errno
import os
import re
import time
from collections.abc import Iterator
from copy import copy
from dataclasses import dataclass, field
from itertools import tee
from typing import TYPE_CHECKING, Final

from robolink.controllers import stop_now
from robolink.errors import (
    ConfigError,
    ConnectError,
    LoginRefusedError,
    LoginUnansweredError,
    RobolinkError,
)
from robolink.messages import tr
from robolink.stopping import HolderGoneError, holders_of
from robolink.transport import far_end_of, serves_several
from robolink_cli.stopping.request import StopRequest

if TYPE_CHECKING:
    from robolink.transport import Direction

OPENED_ONCE: Final = ("+serial:", "+modbus-rtu:", "+can:")
"""Schemes of lines that serve one process of a computer."""

_GIVES_WAY_S: Final = (0.5, 1.0)
"""Times in s for which a stop tries whether the only place is free, before it waits as long as for
any answer: who only looks has it for a moment, and a login beside it may never be answered, also
when the place is free again (docs/reference/epson.md 1.1)."""

_IN_USE: Final = (errno.EAGAIN, errno.EBUSY)
"""What a system says of a port that another process has locked."""

_USER_OF_OPC_UA: Final = re.compile(r"\+opcua://.*[?&]user=")


@dataclass
class StopOutcome:
    """How a stop ended.

    Attributes:
        url: Whom it was for; empty when that is not known.
        state: The controller's state at rest; empty when it was not seen.
        holder: Who stopped it for us; empty when this process did.
        error: Why it is not confirmed.
        keys: The far end.
        controller: Which controller it is, as it said itself once it stood; empty where it
            did not.
        doubts: What was wrong on the way, and did not keep the stop back.
        only: The cell that was taken because it is the only one; empty where one was named.
        heard: What went over the connection: time, direction, bytes; without the login.
    """

    url: str = ""
    state: str = ""
    holder: str = ""
    error: BaseException | None = None
    keys: frozenset[str] = frozenset()
    controller: str = ""
    doubts: list[str] = field(default_factory=list)
    only: str = ""
    heard: "list[tuple[int, Direction, bytes]]" = field(default_factory=list)

    @property
    def may_stand(self) -> bool:
        """Whether a stop left this computer, so that the next user must know of it."""
        return self.error is None or _left(self.error)


def stop_first(request: StopRequest) -> StopOutcome:
    """Stop the controller in the request; the outcome holds any failure."""
    outcome = StopOutcome()
    try:
        _stop(request, outcome)
    except RobolinkError as error:
        # Here, because a successful stop needs none of it.
        from robolink.controllers import advise_emergency_stop

        outcome.error = advise_emergency_stop(error)
    except (Exception, KeyboardInterrupt) as error:
        outcome.error = error
    return outcome


def who_asks(request: StopRequest) -> str:
    """Return who stops, for the person at another terminal."""
    import getpass  # here, because a stop that informs nobody needs none

    try:
        user = getpass.getuser()
    except (OSError, KeyError, ImportError):
        user = "?"
    named = request.operator or user
    return tr("{who} (process {pid})", who=named, pid=os.getpid())


def _stop(request: StopRequest, outcome: StopOutcome) -> None:
    password_file = request.password_file or os.environ.get("ROBOLINK_PASSWORD_FILE", "")
    password_env = ""
    named = request.named
    if not named:
        from robolink_cli.access.cell import nothing_named, only_cell

        named = outcome.only = only_cell()
        if not named:
            raise nothing_named()
    outcome.url = named
    if "+" not in named and "://" not in named:
        from robolink.config import reach_cell

        reach = reach_cell(named)
        outcome.url, password_env = reach.url, reach.password_env
        password_file = password_file or reach.password_file
        outcome.doubts += [reach.doubt] if reach.doubt else []
    outcome.keys = far_end_of(outcome.url)
    several = serves_several(outcome.url)
    (passwords,) = tee(_passwords(outcome, password_file, password_env), 1)
    refusals: list[RobolinkError] = []
    if not several and _through_holder(request, outcome, refusals):
        return
    try:
        if not several and not refusals and _as_soon_as_free(request, outcome, refusals, passwords):
            return
        _directly(request, outcome, passwords)
    except RobolinkError as error:
        again = several or isinstance(error, ConnectError)
        if again and _through_holder(request, outcome, refusals, also=_last_known(outcome.url)):
            return
        told = _most_telling(error, refusals)
        if told is error:
            raise
        raise told from error
    else:
        # Inform a process that has it locked by another address, such as a PLC's network address.
        _through_holder(request, outcome)


def _as_soon_as_free(
    request: StopRequest,
    outcome: StopOutcome,
    refusals: list[RobolinkError],
    passwords: Iterator[str],
) -> bool:
    """Stop what serves one client, which may be one that has it for a moment only.

    Returns:
        Whether it was stopped; if not, it is to be tried once more, for as long as for any answer.

    Raises:
        RobolinkError: As from one attempt, but that the place is taken.
    """
    is_line = any(line in outcome.url for line in OPENED_ONCE)
    for patience_s in _GIVES_WAY_S:
        until_s = time.monotonic() + patience_s
        try:
            _directly(request, outcome, passwords, login_s=None if is_line else patience_s)
        except ConnectError as error:
            if not (_is_in_use(error) if is_line else isinstance(error, LoginUnansweredError)):
                raise
        else:
            _through_holder(request, outcome)
            return True
        time.sleep(max(0.0, until_s - time.monotonic()))
        if _through_holder(request, outcome, refusals):
            return True
        if refusals:
            break
    return False


def _is_in_use(error: ConnectError) -> bool:
    """Whether a line could not be opened because another process has it."""
    return isinstance(error.__cause__, OSError) and error.__cause__.errno in _IN_USE


def _left(error: BaseException) -> bool:
    """Return whether a stop may have left a computer, although it ended in ``error``."""
    return not isinstance(error, (ConfigError, ConnectError, LoginRefusedError))


def _most_telling(error: RobolinkError, refusals: list[RobolinkError]) -> RobolinkError:
    """Return how an unconfirmed stop ended: one that may have left takes precedence.

    Args:
        error: What the attempt from here ended in.
        refusals: What the stops of those who have the controller ended in.
    """
    for one in (error, *refusals):
        if _left(one):
            return one
    # The process that has it locked knows more than one that could not connect.
    return refusals[0] if refusals and isinstance(error, ConnectError) else error


def _last_known(url: str) -> str:
    """Return who was last reached at a silent address, from the journal.

    Nothing is kept back by it: the stop was tried at the address itself before.
    """
    from robolink_cli.stopping.notes import last_known

    return last_known(url)


def _through_holder(
    request: StopRequest,
    outcome: StopOutcome,
    refusals: list[RobolinkError] | None = None,
    *,
    also: str = "",
) -> bool:
    """Let the process that has the controller on this computer stop it; False if none did.

    Args:
        request: What was asked for.
        outcome: Tells the far end and the controller, and takes what becomes of it.
        refusals: Takes why one could not stop it.
        also: The controller's own name, where it is not known from itself.
    """
    names = {name for name in (outcome.controller, also) if name}
    for holder in holders_of(outcome.keys | names):
        try:
            state = holder.ask_to_stop(who_asks(request))
        except HolderGoneError:
            continue
        except RobolinkError as error:
            if refusals is not None:
                refusals.append(error)
            continue
        outcome.state = outcome.state or state
        outcome.holder = holder.who or tr("process {pid}", pid=holder.pid)
        outcome.controller = outcome.controller or holder.controller
        return True
    return False


def _directly(
    request: StopRequest,
    outcome: StopOutcome,
    passwords: Iterator[str],
    *,
    login_s: float | None = None,
) -> None:
    """Stop the controller from this process.

    Args:
        request: What was asked for.
        outcome: Takes what becomes of it.
        passwords: Those to try, asked for once; one that is refused is taken from them.
        login_s: Longest wait for the answer to a login; as for any other if not given.
    """

    def met(name: str) -> None:
        outcome.controller = name

    kept = request.record or request.log_file
    refused: LoginRefusedError | None = None
    for password in copy(passwords):
        try:
            status = stop_now(
                outcome.url,
                password=password,
                timeout_s=request.timeout_s,
                login_s=login_s,
                trace=(lambda *passage: outcome.heard.append(passage)) if kept else None,
                met=met,
            )
        except LoginRefusedError as error:
            refused = refused or error
            next(passwords)
            continue
        outcome.state = str(status.state)
        return
    if refused is not None:
        raise refused


def _passwords(outcome: StopOutcome, file: str, variable: str) -> Iterator[str]:
    """Yield passwords to try; the keyring last, because it is slow, or asks."""
    if not (outcome.url.startswith("epson+") or _USER_OF_OPC_UA.search(outcome.url)):
        yield ""
        return
    from robolink.config.passwords import from_keyring, from_places

    try:
        near = from_places(file or None, variable or None)
    except ConfigError as error:
        outcome.doubts.append(error.what)
        near = None
    if near is not None:
        yield near.reveal()
    from robolink.transport import parse_url

    try:
        stored = from_keyring(parse_url(outcome.url).identity)
    except ConfigError as error:
        outcome.doubts.append(error.what)
        stored = None
    if stored is not None:
        yield stored.reveal()
    elif near is None:
        yield ""


def is_beside_another(error: BaseException) -> bool:
    """Whether a stop failed because the controller serves another client."""
    return isinstance(error, LoginUnansweredError)
