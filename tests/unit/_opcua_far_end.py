"""A small OPC UA server with a mailbox as a CODESYS runtime shows it, in a thread of its own."""

import asyncio
import hashlib
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from functools import cache
from typing import TYPE_CHECKING, Any

from tests.unit._rsa_keys import rsa_key

if TYPE_CHECKING:
    from asyncua.crypto.permission_rules import User

NAMESPACES = 4
TYPES = {
    "command": ("UInt16", [0] * 64, True),
    "response": ("UInt16", [7, *range(112), 7], False),
    "slots": ("UInt16", list(range(544)), False),
    "heartbeat": ("UInt16", 0, True),
    "tool": ("Double", [0.5 * number for number in range(24)], True),
    "real": ("Float", 1.5, True),
    "flag": ("Boolean", False, True),
}
"""Kind, value and whether it may be written, of each variable."""

POLICIES = ("NoSecurity", "Basic256Sha256_SignAndEncrypt", "Aes256Sha256RsaPss_SignAndEncrypt")


def symbol(name: str) -> str:
    """Return the id of a variable."""
    return f"ns={NAMESPACES};s=|var|PLC.Application.RL_Symbols.{name}"


@dataclass
class FarEnd:
    """A served one; its coroutines run in its own thread."""

    port: int
    loop: asyncio.AbstractEventLoop
    server: Any
    users: "Users"
    nodes: dict[str, Any] = field(default_factory=dict)

    def url(self, kind: str = "softmotion", **options: str) -> str:
        told = {"security": "none", "write_unsecured": "yes"} | options
        query = "&".join(f"{name}={value}" for name, value in told.items())
        return f"{kind}+opcua://127.0.0.1:{self.port}?{query}"

    def run(self, coroutine: Any) -> Any:
        return asyncio.run_coroutine_threadsafe(coroutine, self.loop).result(10)

    def value(self, name: str) -> Any:
        return self.run(self.nodes[name].read_value())

    def put(self, name: str, value: Any, status: str = "Good") -> None:
        from asyncua import ua

        variant = ua.Variant(value, getattr(ua.VariantType, TYPES[name][0]))
        given = ua.DataValue(variant, ua.StatusCode(getattr(ua.StatusCodes, status)))
        self.run(self.nodes[name].write_value(given))

    def add_structure(self, name: str) -> Any:
        """Add a structure of a flag, an array and a structure, below Objects."""
        return self.run(_structure(self.server, name))


async def _structure(server: Any, name: str) -> Any:
    from asyncua import ua
    from asyncua.common.structures104 import new_struct, new_struct_field

    x, y = (
        new_struct_field(axis, kind)
        for axis, kind in (("X", ua.VariantType.Double), ("Y", ua.VariantType.Float))
    )
    pose, _ = await new_struct(server, NAMESPACES, "Pose", [x, y])
    fields = [
        new_struct_field("Valid", ua.VariantType.Boolean),
        new_struct_field("Offsets", ua.VariantType.Double, array=True),
        new_struct_field("Pose", pose),
    ]
    tool, _ = await new_struct(server, NAMESPACES, "Tool", fields)
    made = await server.load_data_type_definitions()
    value = made["Tool"](Valid=True, Offsets=[1.0, 2.0, 3.0], Pose=made["Pose"](X=1.5, Y=2.5))
    node = await server.nodes.objects.add_variable(
        ua.NodeId(name, NAMESPACES),
        f"{NAMESPACES}:{name}",
        ua.Variant(value, ua.VariantType.ExtensionObject),
        datatype=tool.nodeid,
    )
    await node.set_writable()
    return node


@dataclass(frozen=True)
class Own:
    """A certificate, DER, and its key, PEM."""

    certificate: bytes
    key: bytes

    @property
    def fingerprint(self) -> str:
        return hashlib.sha256(self.certificate).hexdigest()


@cache
def own(name: str) -> Own:
    """Return a certificate as OPC UA wants it, with its URI ``urn:NAME`` and its own key."""
    from cryptography import x509
    from cryptography.hazmat.primitives import hashes, serialization

    key = rsa_key(("server", "robolink").index(name))
    subject = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, name)])
    now = datetime.now(UTC)
    made = (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(subject)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - timedelta(days=1))
        .not_valid_after(now + timedelta(days=1))
        .add_extension(
            x509.SubjectAlternativeName(
                [x509.UniformResourceIdentifier(f"urn:{name}"), x509.DNSName("localhost")]
            ),
            critical=False,
        )
        .sign(key, hashes.SHA256())
    )
    pem = key.private_bytes(
        serialization.Encoding.PEM,
        serialization.PrivateFormat.PKCS8,
        serialization.NoEncryption(),
    )
    return Own(made.public_bytes(serialization.Encoding.DER), pem)


class Users:
    """Lets Anna in, with her password, and anybody without a name while ``open`` is set."""

    def __init__(self) -> None:
        self.open = True

    def get_user(
        self, iserver: Any, username: Any = None, password: Any = None, certificate: Any = None
    ) -> "User | None":
        from asyncua.crypto.permission_rules import User, UserRole

        right = (username, password) == ("Anna", "correct horse")
        anybody = username is None and self.open
        return User(role=UserRole.User, name=username) if right or anybody else None


async def _made(users: Users, standard: Any) -> tuple[Any, dict[str, Any]]:
    from asyncua import Server, ua
    from asyncua.server.internal_server import InternalServer

    internal: Any = InternalServer(users)

    async def take_standard(_shelf_file: Any) -> None:
        internal.aspace._nodes = standard  # which takes a second to make

    internal.load_standard_address_space = take_standard
    server = Server(iserver=internal)
    await server.init()
    await server.load_certificate(own("server").certificate, "der")
    await server.load_private_key(own("server").key, format="pem")
    await server.set_application_uri("urn:server")
    server.set_endpoint("opc.tcp://127.0.0.1:0")
    server.set_security_policy([getattr(ua.SecurityPolicyType, name) for name in POLICIES])
    for number in range(2, NAMESPACES + 1):
        await server.register_namespace(f"urn:test:{number}")
    above = server.nodes.objects
    for name in ("DeviceSet", "PLC", "Resources", "Application", "GlobalVars", "RL_Symbols"):
        node = ua.NodeId(f"|way|{name}", NAMESPACES)
        above = await above.add_object(node, f"{NAMESPACES}:{name}")
    nodes = {}
    for name, (kind, value, writable) in TYPES.items():
        node = await above.add_variable(
            ua.NodeId.from_string(symbol(name)),
            f"{NAMESPACES}:{name}",
            value,
            varianttype=getattr(ua.VariantType, kind),
        )
        if writable:
            await node.set_writable()
        nodes[name] = node
    return server, nodes


@contextmanager
def far_end() -> Iterator[FarEnd]:
    """Serve one on a free port of loopback, with and without security."""
    from robolink_simulators.hosting.fieldbus.opcua_nodes import OwnNodes

    standard = OwnNodes()  # first: only what follows has a limit
    loop = asyncio.new_event_loop()
    thread = threading.Thread(target=loop.run_forever, daemon=True)
    thread.start()

    def run(coroutine: Any) -> Any:
        return asyncio.run_coroutine_threadsafe(coroutine, loop).result(40)

    users = Users()
    server, nodes = run(_made(users, standard))
    run(server.start())
    try:
        port = server.bserver._server.sockets[0].getsockname()[1]
        yield FarEnd(port, loop, server, users, nodes)
    finally:
        run(server.stop())
        loop.call_soon_threadsafe(loop.stop)
        thread.join()
        loop.close()
