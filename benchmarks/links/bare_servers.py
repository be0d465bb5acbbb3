"""A Modbus and an OPC UA server whose values stand still, in a process of their own.

So that two clients are compared, not two simulators: ``python -m benchmarks.links.bare_servers``
prints where it listens as JSON, and runs until it is terminated.
"""

import asyncio
import json
import logging
import tempfile
from hashlib import sha256
from pathlib import Path
from typing import Any, Final

from asyncua import Server, ua
from asyncua.crypto.cert_gen import setup_self_signed_certificate
from cryptography import x509
from cryptography.hazmat.primitives.serialization import Encoding
from cryptography.x509.oid import ExtendedKeyUsageOID
from pymodbus.server import ModbusTcpServer
from pymodbus.simulator import DataType, SimData, SimDevice

LREALS: Final = 24
WORDS: Final = 112
ARRAY: Final = "ns=2;s=|var|Bench.Application.GVL.aTool"
_URI: Final = "urn:robolink:bench"
_POLICIES: Final = (
    ua.SecurityPolicyType.NoSecurity,
    ua.SecurityPolicyType.Basic256Sha256_SignAndEncrypt,
)


async def _serve() -> None:
    logging.getLogger("asyncua").setLevel(logging.ERROR)
    words = SimData(0, count=WORDS, values=1, datatype=DataType.REGISTERS)
    modbus = ModbusTcpServer(SimDevice(id=1, simdata=words), address=("127.0.0.1", 0))
    await modbus.serve_forever(background=True)
    with tempfile.TemporaryDirectory() as folder:
        key, certificate = Path(folder, "key.pem"), Path(folder, "certificate.der")
        usages = [ExtendedKeyUsageOID.SERVER_AUTH]
        await setup_self_signed_certificate(key, certificate, _URI, "localhost", usages, {})
        opcua = await _opcua(key, certificate)
        where = {
            "modbus": _port(modbus.transport),
            "opcua": _port(opcua.bserver._server),  # noqa: SLF001 - it tells its port nowhere else
            "server_certificate": _fingerprint(certificate.read_bytes()),
        }
    print(json.dumps(where), flush=True)
    await asyncio.Event().wait()


async def _opcua(key: Path, certificate: Path) -> Server:
    server = Server()
    await server.init()
    await server.set_application_uri(_URI)
    server.set_endpoint("opc.tcp://127.0.0.1:0")
    server.set_security_policy([*_POLICIES])
    await server.load_certificate(str(certificate))
    await server.load_private_key(str(key))
    index = await server.register_namespace("urn:bench")
    tool = [float(number) for number in range(LREALS)]
    await server.nodes.objects.add_variable(ARRAY, f"{index}:aTool", tool, ua.VariantType.Double)
    await server.start()
    return server


def _port(server: Any) -> int:  # noqa: ANN401 - pymodbus calls its listening server a transport
    port: int = server.sockets[0].getsockname()[1]
    return port


def _fingerprint(certificate: bytes) -> str:
    if certificate.startswith(b"-----"):
        certificate = x509.load_pem_x509_certificate(certificate).public_bytes(Encoding.DER)
    return sha256(certificate).hexdigest()


if __name__ == "__main__":
    asyncio.run(_serve())
