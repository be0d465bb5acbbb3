"""Check all cells at night and mail what somebody should see to; nothing moves.

    python nightly_check.py --smtp mail.plant:25 --sender cells@plant --to day.shift@plant [CELL...]

Without CELL it checks all of robolink.toml. A mail comes every night; where none does, this job did
not run. SMTP_USER and SMTP_PASSWORD go over TLS only. Exit codes: those of 'robolink check' (0 in
order, 1 see to something), 70 not checked in time, 69 not mailed: the report is on stdout.
"""

import argparse
import json
import os
import smtplib
import ssl
import subprocess
import sys
from collections.abc import Sequence
from email.message import EmailMessage
from typing import Any


def check(cells: Sequence[str]) -> tuple[int, dict[str, Any]]:
    """Return the exit code of ``robolink check`` and its document."""
    command = [sys.executable, "-m", "robolink_cli", "--json", "check", *cells]
    done = subprocess.run(command, capture_output=True, timeout=900, check=False)
    return done.returncode, dict(json.loads(done.stdout))


def report(document: dict[str, Any]) -> tuple[str, list[str]]:
    """Return the subject and the lines of the mail, what needs attention first."""
    if document["schema"] == "robolink/error/1":  # a cell file that cannot be read, for example
        return "cells NOT checked", [said(document["error"])]
    lines, bad = list[str](), [one["cell"] for one in document["cells"] if not one["ok"]]
    for one in sorted(document["cells"], key=lambda cell: bool(cell["ok"])):
        lines.append(f"{one['cell']}: {'in order' if one['ok'] else 'SEE TO THIS'}")
        lines += [f"    {said(item)}" for item in one["findings"] or filter(None, [one["error"]])]
    see = f"{len(bad)} of {len(document['cells'])} cells need attention"
    return f"{see}: {', '.join(bad)}" if bad else see, lines


def said(item: dict[str, str]) -> str:
    return f"{item.get('sentence') or item['what']} {item['remedy']}".rstrip()


def send(server: str, message: EmailMessage) -> None:
    host, _, port = server.partition(":")
    with smtplib.SMTP(host, int(port or 25), timeout=30) as smtp:
        if user := os.environ.get("SMTP_USER"):
            smtp.starttls(context=ssl.create_default_context())
            smtp.login(user, os.environ["SMTP_PASSWORD"])
        smtp.send_message(message)


def main(words: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(usage=__doc__)
    for name in ("--smtp", "--sender", "--to"):
        parser.add_argument(name, required=True)
    parser.add_argument("cells", nargs="*")
    given = parser.parse_args(words)
    try:
        code, document = check(given.cells)
        subject, lines = report(document)
    except (subprocess.TimeoutExpired, ValueError) as error:
        code, subject, lines = 70, "cells NOT checked", [str(error)]
    try:
        message = EmailMessage()
        message["From"], message["To"], message["Subject"] = given.sender, given.to, subject
        message.set_content("\n".join(lines))
        send(given.smtp, message)
    except (OSError, smtplib.SMTPException, KeyError, ValueError) as error:
        print(f"not mailed ({error!r}):", subject, *lines, sep="\n")
        return 69
    return code


if __name__ == "__main__":
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit(130)
