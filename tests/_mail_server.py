"""A mail server on loopback that keeps the mails it receives."""

import socketserver
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from email import message_from_bytes, policy
from email.message import EmailMessage
from typing import cast

REFUSED = "nobody@plant"
"""Mail to this address is refused."""


class _Dialogue(socketserver.StreamRequestHandler):
    """The part of SMTP (RFC 5321) that a client needs to send one mail."""

    def handle(self) -> None:
        self.wfile.write(b"220 here\r\n")
        while command := self.rfile.readline().strip().upper():
            if command == b"DATA":
                self.wfile.write(b"354 go on\r\n")
                lines = list(iter(self.rfile.readline, b".\r\n"))
                mail = message_from_bytes(b"".join(lines), policy=policy.default)
                cast("_Server", self.server).mails.append(mail)
            refused = REFUSED.upper().encode() in command
            code = b"550" if refused else b"221" if command == b"QUIT" else b"250"
            self.wfile.write(code + b" said\r\n")


class _Server(socketserver.ThreadingTCPServer):
    daemon_threads = True

    def __init__(self) -> None:
        super().__init__(("127.0.0.1", 0), _Dialogue)
        self.mails: list[EmailMessage] = []


@contextmanager
def mail_server() -> Iterator[tuple[str, list[EmailMessage]]]:
    """Run the server during the block; yield ``HOST:PORT`` and the list of received mails."""
    with _Server() as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.01,))
        thread.start()
        try:
            yield f"127.0.0.1:{server.server_address[1]}", server.mails
        finally:
            server.shutdown()
            thread.join()
