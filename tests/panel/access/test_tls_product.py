"""The panel as tablets on the network reach it: TLS, its own certificate, pairing, and silence."""

import http.client
import json
import socket
import ssl
from contextlib import ExitStack

import pytest
from robolink_cli.panel.guard import connections, tls
from robolink_cli.panel.guard.pairing import PairedTablets
from robolink_cli.panel.guard.people import Pins
from robolink_cli.panel.serving import PanelPlace
from robolink_cli.panel.watch import CellWatch

from robolink.model import Secret
from tests.panel.access._bare import CELL, MEI, PINS
from tests.panel.access.test_many_connections import is_closed
from tests.panel.access.test_product import Product


class Tablet:
    """A browser that trusts the panel's certificate, by the name in it."""

    def __init__(self, port, trusts):
        self.port, self.trusts, self.jar = port, trusts, {}

    def ask(self, method, path, said=None, origin=None):
        line = http.client.HTTPSConnection("localhost", self.port, timeout=10, context=self.trusts)
        here = f"localhost:{self.port}"
        headers = {
            "Host": here,
            "Origin": origin or f"https://{here}",
            "Sec-Fetch-Site": "same-origin",
            "Content-Type": "application/json",
            "Cookie": "; ".join(f"{key}={value}" for key, value in self.jar.items()),
        }
        try:
            line.request(method, path, json.dumps(said) if said else None, headers)
            answer = line.getresponse()
            answer.read()
        finally:
            line.close()
        cookies = answer.headers.get_all("Set-Cookie") or []
        for cookie in cookies:
            key, _, value = cookie.partition(";")[0].partition("=")
            self.jar[key] = value
        return answer.status, cookies


@pytest.fixture
def product(state_folder, monkeypatch):
    async def looks_at_nothing(_self):
        pass

    monkeypatch.setattr(CellWatch, "take", looks_at_nothing)
    Pins().set(MEI, Secret(PINS[MEI]))
    made = tls.make(("localhost",))
    product = Product()
    place = PanelPlace("0.0.0.0", 0, str(made.path), str(made.key))
    with product.served(place, names=made.names):
        product.trusts = ssl.create_default_context(cafile=str(made.path))
        yield product


def test_a_tablet_on_the_network_is_paired_over_tls_and_stops(product, monkeypatch):
    tablet = Tablet(product.port, product.trusts)
    old = {"cell": CELL, "press": "1", "age_ms": 6000}
    assert tablet.ask("GET", "/")[0] == 303
    assert tablet.ask("GET", "/pair")[0] == 200
    assert tablet.ask("POST", "/stop", old)[0] == 403
    status, cookies = tablet.ask("POST", "/pair", {"name": MEI, "pin": PINS[MEI]})
    assert status == 200
    assert all("; Secure" in cookie and cookie.startswith("__Host-") for cookie in cookies)
    assert tablet.ask("GET", f"/cell/{CELL}")[0] == 200
    assert tablet.ask("POST", "/stop", old)[0] == 200
    assert tablet.ask("POST", "/stop", old, origin=f"http://localhost:{product.port}")[0] == 403
    # The certificate is for another name.
    with pytest.raises(ssl.SSLCertVerificationError):
        product.trusts.wrap_socket(
            socket.create_connection(("127.0.0.1", product.port), 5), server_hostname="127.0.0.1"
        )
    # Connections that never begin TLS take no place for long, nor that of a tablet.
    monkeypatch.setattr(connections, "STRANGER_S", 0.3)
    with ExitStack() as stack:
        held = [
            stack.enter_context(
                socket.create_connection(("127.0.0.1", product.port), 5, ("127.0.0.66", 0))
            )
            for _ in range(100)
        ]
        assert tablet.ask("POST", "/stop", old)[0] == 200
        assert all(is_closed(line, 3.0) for line in held)
    (paired,) = PairedTablets().all()
    PairedTablets().forget(paired.id)
    assert tablet.ask("POST", "/stop", old)[0] == 403
    assert [facts["why"] for kind, _, facts in product.kept if kind == "refused"].count(
        "unpaired"
    ) == 2
