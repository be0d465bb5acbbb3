"""Who may see, stop and command from a page: asked before a request reaches the panel.

Everything passes :func:`~robolink_cli.panel.guard.gate.guarded`. What a request needs stands in one
table there; what is in no table is refused. STOP needs a paired tablet and nothing else.
"""

import asyncio
import hmac
from collections.abc import Callable, Collection, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from hashlib import sha256
from ipaddress import ip_address
from typing import Any, Final, Protocol

from robolink import runtime
from robolink.messages import tr
from robolink.model import PersonRole
from robolink.timing import NS_PER_S, Clock, SystemClock
from robolink_cli.panel.guard.connections import Connections, network_of
from robolink_cli.panel.guard.pairing import (
    Logins,
    PairedTablets,
    Tablet,
    is_secret,
    new_secret,
    tablet_id,
)
from robolink_cli.panel.guard.people import NOBODY, Pins, Tries, address_key, name_key
from robolink_cli.panel.guard.requests import MOST_BYTES, Denial, PageRequest
from robolink_cli.panel.guard.seat import Seats

COMMANDS_A_SECOND: Final = 20.0
"""Of one tablet; STOP does not count."""

FRAMES_A_SECOND: Final = 100.0
"""Of one tablet, beats and signs of life among them; STOP does not count."""

_MOST_PROOFS: Final = 8
"""PINs that may wait to be looked at."""

_MOST_RATES: Final = 1000
_VISIT: Final = "robolink.visit"
_COOKIE_S: Final = 400 * 86_400
_LOOPBACK: Final = frozenset({"localhost", "127.0.0.1", "::1"})

People = Mapping[str, PersonRole]


class Notes(Protocol):
    """Where something is put on record, as ``audit`` does it."""

    def note(self, kind: str, cell: str, **facts: object) -> None:
        """Put something on record; see there."""


class _NoNotes:
    def note(self, kind: str, cell: str, **facts: object) -> None:
        """Keep nothing."""


@dataclass(frozen=True, slots=True)
class Visit:
    """What a request carries of its tablet.

    Attributes:
        tablet: Id of the tablet; empty where it has none.
        secret: The secret that it is named by; empty where it has none.
        fresh: Whether the secret was drawn just now, and goes out with the answer.
        logins: The secrets of logins that came with it.
        address: Where it is.
        peer: Address and port.
    """

    tablet: str
    secret: str
    fresh: bool
    logins: tuple[str, ...]
    address: str
    peer: tuple[str, int]


def is_loopback(host: str) -> bool:
    """Return whether only this computer reaches what listens there."""
    if host.lower() == "localhost":
        return True
    try:
        return ip_address(host.strip("[]").partition("%")[0]).is_loopback
    except ValueError:
        return False


class Access:
    """Who may do what; one for each panel.

    Args:
        host: Where it listens.
        port: At which port.
        tls: Whether it speaks TLS.
        names: Names and addresses by which it may be called, besides ``host``: those of its
            certificate.
        people: Of each cell that it shows the people of the cell file, ``None`` where that
            names none.
        audit: Where it is put on record.
        speaking: Gives the language of a tablet, by its id, for a block.
        pins, tablets, tries: Of another folder than the user's.
        clock: In which PINs, rates and silence count.

    Attributes:
        seats: Who commands which cell.
        connections: What is connected.
    """

    def __init__(
        self,
        *,
        host: str = "127.0.0.1",
        port: int,
        tls: bool = False,
        names: Collection[str] = (),
        people: Mapping[str, People | None],
        audit: Notes | None = None,
        speaking: Callable[[str], AbstractContextManager[object]] = lambda _: nullcontext(),
        pins: Pins | None = None,
        tablets: PairedTablets | None = None,
        tries: Tries | None = None,
        clock: Clock | None = None,
    ) -> None:
        self.clock = clock or SystemClock()
        self.port, self.tls, self.people = port, tls, people
        self.open_here = is_loopback(host)
        self.hosts = frozenset(
            {name.lower() for name in names}
            | ({host.lower().strip("[]")} - {"0.0.0.0", "::"})
            | (_LOOPBACK if self.open_here else frozenset())
        )
        self.audit: Notes = audit or _NoNotes()
        self.speaking = speaking
        self.pins = pins or Pins()
        self.tablets = tablets or PairedTablets()
        self.tries = tries or Tries()
        self.logins = Logins(self.pins, self.clock)
        self.seats = Seats(self.clock)
        self.connections = Connections()
        self._key = runtime.random_bytes(32)
        self._one_by_one = ThreadPoolExecutor(1, thread_name_prefix="robolink-pin")
        self._proofs = 0
        self._rates: dict[str, tuple[float, int]] = {}

    def note(self, kind: str, cell: str, **facts: object) -> None:
        """Put something on record; see :class:`Notes`."""
        self.audit.note(kind, cell, **facts)

    def server_options(self) -> dict[str, Any]:
        """Return what uvicorn has to be told, so that nothing passes beside this guard.

        It must not believe ``X-Forwarded-For``, which would give any address to whoever asks, and
        it must listen on :func:`~robolink_cli.panel.guard.connections.listening`.
        """
        return {
            "loop": "asyncio",
            "http": "h11",
            "proxy_headers": False,
            "server_header": False,
            "access_log": False,
            "h11_max_incomplete_event_size": 4 * MOST_BYTES,
            "timeout_keep_alive": 5,
            "ws_max_size": MOST_BYTES,
            "ws_max_queue": 16,
            "ws_ping_interval": 5.0,
            "ws_ping_timeout": 5.0,
            "ws_per_message_deflate": False,
        }

    # ---- Tablets

    def tablet_of(self, scope: Mapping[str, Any]) -> Tablet:
        """Return the tablet that a request or a WebSocket came from, as it stands now.

        Args:
            scope: Of ASGI, as the guard handed it on.
        """
        visit: Visit = scope[_VISIT]
        session = next(
            filter(None, (self.logins.session(visit.tablet, one) for one in visit.logins)), None
        )
        return Tablet(visit.tablet, visit.address, self.is_paired(visit.tablet), session)

    def is_paired(self, tablet: str) -> bool:
        """Return whether a tablet may look and stop; on loopback every browser may."""
        return self.open_here or (bool(tablet) and self.tablets.holds(tablet))

    def token_of(self, scope: Mapping[str, Any]) -> str:
        """Return what a page of this tablet has to send in the header X-Robolink-Token.

        Args:
            scope: Of ASGI, as the guard handed it on.
        """
        visit: Visit = scope[_VISIT]
        return hmac.new(self._key, visit.tablet.encode(), sha256).hexdigest()

    def visit(self, request: PageRequest) -> Visit:
        """Return what a request carries of its tablet, and keep it for :meth:`tablet_of`."""
        secrets = [one for one in request.cookies(self.cookie_name("tablet")) if is_secret(one)]
        known = [one for one in secrets if self.tablets.holds(tablet_id(one))]
        secret, fresh = (known or secrets or [""])[0], False
        if not secret and self.open_here and (request.keeps_cookies or request.method == "POST"):
            secret, fresh = new_secret(), True
        client = request.scope.get("client") or ("", 0)
        visit = Visit(
            tablet_id(secret) if secret else "",
            secret,
            fresh,
            tuple(one for one in request.cookies(self.cookie_name("login")) if is_secret(one)),
            str(client[0]),
            (str(client[0]), int(client[1])),
        )
        request.scope[_VISIT] = visit
        return visit

    def cookie_name(self, kind: str) -> str:
        """Return a cookie's name; without TLS it names the port, which cookies do not."""
        return f"{'__Host-' if self.tls else ''}robolink-{kind}-{self.port}"

    def cookie(self, kind: str, value: str) -> str:
        """Return a ``Set-Cookie``; an empty value removes it."""
        age = "" if value and kind != "tablet" else f"; Max-Age={_COOKIE_S if value else 0}"
        secure = "; Secure" if self.tls else ""
        name = self.cookie_name(kind)
        return f"{name}={value}; Path=/; HttpOnly; SameSite=Strict{secure}{age}"

    # ---- Who may

    def role(self, who: str, cell: str) -> PersonRole | None:
        """Return a person's role at a cell; ``None`` where this is none of its people.

        Where the cell names no people, whoever has the panel's own PIN is an engineer there.
        """
        people = self.people.get(cell, {})
        if people is None:
            return PersonRole.ENGINEER if who == NOBODY else None
        return people.get(who)

    def role_at(self, tablet: Tablet, cell: str) -> PersonRole | None:
        """Return the role at a cell of who is logged in on a tablet; ``None`` for an onlooker."""
        return None if tablet.session is None else self.role(tablet.session.who, cell)

    def highest_role(self, who: str) -> PersonRole | None:
        """Return a person's highest role at any cell of this panel."""
        roles = {self.role(who, cell) for cell in self.people} - {None}
        return PersonRole.ENGINEER if PersonRole.ENGINEER in roles else next(iter(roles), None)

    def why_not(self, tablet: Tablet, cell: str, *, young: bool = True) -> str:
        """Return why a tablet may not move or write at a cell now; empty where it may.

        Args:
            tablet: The tablet.
            cell: Name of the cell. Whether the tablet has its seat, ``seats`` says.
            young: Whether the PIN has to be young, as it does for all that moves or writes.
        """
        if cell not in self.people:
            return tr("There is no cell {name!r}.", name=cell)
        if not tablet.paired:
            return tr("This tablet is not paired with the panel.")
        if (missing := self._missing_pin(cell)) and tablet.session is None:
            return missing
        if tablet.session is None:
            return tr("Log in with your PIN first.")
        if self.role(tablet.session.who, cell) is None:
            return tr(
                "{who} is not among the people of this cell.",
                who=tablet.session.who or tr("The panel's own PIN"),
            )
        if young and not self.logins.is_fresh(tablet.session):
            return tr("The PIN was given more than 15 minutes ago. Give it again.")
        return ""

    def why_no_engineer(self, tablet: Tablet) -> str:
        """Return why a tablet may not do what takes an engineer of any cell; empty where it may.

        Args:
            tablet: The tablet, which is paired.
        """
        if tablet.session is None:
            return tr("Log in with your PIN first.")
        if self.highest_role(tablet.session.who) is not PersonRole.ENGINEER:
            return tr("This takes an engineer.")
        if not self.logins.is_fresh(tablet.session):
            return tr("The PIN was given more than 15 minutes ago. Give it again.")
        return ""

    def why_not_answer(self, tablet: Tablet, cell: str, begun_by: str) -> str:
        """Return why a tablet may not answer a job; empty where it may.

        A job has the rights of who began it: an operator does not go on with an engineer's.

        Args:
            tablet: The tablet.
            cell: Name of the cell.
            begun_by: Who began the job.
        """
        mine, needed = self.role_at(tablet, cell), self.role(begun_by, cell)
        if mine is PersonRole.ENGINEER or (mine is not None and mine is needed):
            return ""
        return tr("{who} began this as an engineer: an engineer has to go on.", who=begun_by)

    def _missing_pin(self, cell: str) -> str:
        people = self.people[cell]
        if people is None:
            if self.pins.mark(NOBODY):
                return ""
            return tr(
                "Nothing can be moved or written from a page before this computer has a PIN for "
                "it. Run there: robolink panel pin"
            )
        if any(self.pins.mark(name) for name in people):
            return ""
        return tr(
            "Nobody of this cell has a PIN yet. Run on the panel's computer: "
            "robolink panel pin NAME"
        )

    # ---- PINs

    async def prove(self, who: str, pin: str, visit: Visit) -> Denial | None:
        """Look at a PIN; wrong ones count for the person and for the address.

        Args:
            who: The person; empty for the panel's own PIN.
            pin: What was typed.
            visit: Where.

        Returns:
            Why it does not count; ``None`` where it does.
        """
        if self._proofs >= _MOST_PROOFS:
            return Denial(503, tr("Too many people are logging in. Try again."), "busy", 1.0)
        self._proofs += 1
        try:
            loop = asyncio.get_running_loop()
            refusal = await loop.run_in_executor(self._one_by_one, self._proved, who, pin, visit)
        finally:
            self._proofs -= 1
        return refusal and Denial(
            refusal.status, refusal.why or _pause(refusal.wait_s), refusal.kind, refusal.wait_s
        )

    def _proved(self, who: str, pin: str, visit: Visit) -> Denial | None:
        keys = [address_key(visit.address)]
        if self.highest_role(who) is not None and self.pins.mark(who):
            # Whoever is outside makes nobody wait who stands at a paired tablet.
            keys.append(name_key(who, outside=not self.is_paired(visit.tablet)))
        if pause_s := self.tries.pause_s(*keys):
            return Denial(429, "", "pause", pause_s)
        try:
            self.tries.count(*keys)
        except OSError:
            why = tr("The panel's computer cannot store that a PIN was tried, so it looks at none.")
            return Denial(503, why, "disk")
        if self.pins.matches(who, pin) and self.highest_role(who) is not None:
            self.tries.forgive(*keys)
            return None
        if pause_s := self.tries.pause_s(*keys):
            return Denial(403, "", "pin", pause_s)
        return Denial(403, tr("This is not the PIN."), "pin")

    # ---- Rates

    def too_often(self, visit: Visit, kind: str, a_second: float) -> bool:
        """Count something, and return whether it came too often."""
        return self.too_often_of(f"{kind} {visit.tablet or network_of(visit.address)}", a_second)

    def too_often_of(self, key: str, a_second: float) -> bool:
        """Count something under a name of its own, and return whether it came too often."""
        now_ns = self.clock.now_ns()
        left, at_ns = self._rates.pop(key, (a_second, now_ns))
        left = min(a_second, left + (now_ns - at_ns) / NS_PER_S * a_second)
        while len(self._rates) >= _MOST_RATES:
            del self._rates[next(iter(self._rates))]
        self._rates[key] = (max(left - 1.0, 0.0), now_ns)
        return left < 1.0

    def close(self) -> None:
        """End the thread that looks at PINs."""
        self._one_by_one.shutdown(wait=False, cancel_futures=True)


def _pause(seconds: float) -> str:
    return tr(
        "Too many wrong PINs. Try again in {seconds:.0f} s. STOP works all the same.",
        seconds=seconds,
    )
