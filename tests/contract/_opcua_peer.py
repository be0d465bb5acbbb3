"""A client of OPC UA that is not ours, for tests of simulated servers: asyncua's."""

import asyncio
import contextlib
from collections.abc import Callable, Coroutine
from typing import Any
from urllib.parse import urlsplit

from asyncua import Client, ua
from asyncua.crypto.security_policies import SecurityPolicyBasic256Sha256
from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat
from robolink_simulators.hosting.fieldbus.opcua_certificate import make_certificate

WAY = ("DeviceSet", "{device}", "Resources", "Application", "GlobalVars", "{variables}", "{name}")
PATIENCE_S = 5.0


class OpcuaPeer:
    """One session; a context manager.

    Args:
        url: As a simulator tells it; only its host and port count.
        device: Name of the controller in the tree.
        secured: Whether it signs and encrypts.
        user: Name and password; nobody without it.
        timeout_s: Of asyncua.
    """

    def __init__(self, url, device, *, secured=False, user=None, timeout_s=PATIENCE_S):
        self._runner = asyncio.Runner()
        self._device = device
        place = urlsplit(url)
        self.client = Client(f"opc.tcp://{place.hostname}:{place.port}", timeout=timeout_s)
        self.nodes: dict[str, Any] = {}
        if user is not None:
            self.client.set_user(user[0])
            self.client.set_password(user[1])
        self._secured = secured

    def __enter__(self):
        try:
            self._run(self._open())
        except BaseException:
            self._runner.close()
            raise
        return self

    def __exit__(self, *_details):
        try:
            self._run(self._close())
        finally:
            self._runner.close()

    def read(self, *paths, attribute=ua.AttributeIds.Value):
        """Return the value of each variable, ``List.name``, all in one request."""
        found = self.answers(*paths, attribute=attribute)
        for one in found:
            one.StatusCode.check()
        return [one.Value.Value for one in found]

    def answers(self, *paths, attribute=ua.AttributeIds.Value, index_range=None):
        """Return what the server answered for each variable, all in one request."""
        params = ua.ReadParameters()
        for path in paths:
            asked = ua.ReadValueId(self.node(path).nodeid, attribute)
            asked.IndexRange = index_range
            params.NodesToRead.append(asked)
        return self._run(self.client.uaclient.read(params))

    def write(self, path, value, kind="UInt16", *, index_range=None, **stamps):
        """Write a variable; return the name of the status."""
        return self.write_all({path: (value, kind)}, index_range=index_range, **stamps)[0]

    def write_all(self, values, *, index_range=None, **stamps):
        """Write variables in one request; return the name of each status."""
        params = ua.WriteParameters()
        for path, (value, kind) in values.items():
            asked = ua.WriteValue()
            asked.NodeId, asked.AttributeId = self.node(path).nodeid, ua.AttributeIds.Value
            asked.IndexRange = index_range
            asked.Value = ua.DataValue(ua.Variant(value, ua.VariantType[kind]), **stamps)
            params.NodesToWrite.append(asked)
        return [code.name for code in self._run(self.client.uaclient.write(params))]

    def node(self, path):
        """Return the node of a variable, found by the names on the way to it."""
        if path not in self.nodes:
            variables, _, name = path.partition(".")
            given = {"device": self._device, "variables": variables, "name": name}
            way = [f"4:{step.format(**given)}" for step in WAY]
            self.nodes[path] = self._run(self.client.nodes.objects.get_child(way))
        return self.nodes[path]

    def do(self, act: Callable[[Client], Coroutine[Any, Any, Any]]) -> Any:
        """Return what comes of an act with asyncua's client."""
        return self._run(act(self.client))

    def _run(self, what):
        return self._runner.run(what)

    async def _open(self):
        if self._secured:
            own = make_certificate("127.0.0.1")
            self.client.application_uri = own.application_uri
            await self.client.set_security(
                SecurityPolicyBasic256Sha256,
                own.certificate.public_bytes(Encoding.DER),
                own.key.private_bytes(Encoding.DER, PrivateFormat.PKCS8, NoEncryption()),
            )
        await self.client.connect()

    async def _close(self):
        with contextlib.suppress(OSError, ua.UaError, TimeoutError):  # the server has ended it
            await asyncio.wait_for(self.client.disconnect(), PATIENCE_S)
