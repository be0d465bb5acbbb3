"""What the checks of the contract found, told whatever ends them: to a person and to pipelines."""

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Final
from xml.etree import ElementTree as Xml

from robolink.errors import ConfigError
from robolink.files.named import save_named
from robolink.messages import tr
from robolink_cli.console.exit_codes import error_body
from robolink_cli.console.render import note

if TYPE_CHECKING:
    from robolink.testing import Check, CheckOutcome

_NO_XML: Final = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""What no XML document may hold, not even escaped; a driver may say it."""

_END: Final = "what_was_there_is_put_back"
"""The case that says what ended the checks after the last of them."""


class ContractReport:
    """Collects how each promise was found.

    The file for pipelines is whole at any moment. Until the end it says that there was none, so
    that a file of before, or one of a process that was killed, is not taken for a good end.

    Args:
        checks: The checks that were asked for.
        junit: The file for pipelines; ``None`` for none.

    Attributes:
        identity: Who is checked, as soon as that is known.
        found: How those were found that were looked at, in their order.
    """

    def __init__(self, checks: "Sequence[Check]", junit: Path | None) -> None:
        self.identity = ""
        self.found: list[CheckOutcome] = []
        self._checks = checks
        self._junit = junit

    @property
    def broken(self) -> "list[CheckOutcome]":
        """The promises that are broken."""
        return [one for one in self.found if one.broken and one.error is None]

    @contextmanager
    def told(self, *, on_the_way: bool) -> Iterator[None]:
        """Surround the checks: whatever ends the block, it is told how far they came.

        Args:
            on_the_way: Whether a person read of each check as it was made.

        Raises:
            ConfigError: The file cannot be written.
        """
        self._write("the checks have not ended")
        try:
            yield
        except BaseException as error:
            self._tell_a_person(on_the_way=on_the_way)
            try:
                self._write(str(error_body(error)["what"]))
            except ConfigError as unwritten:
                note(unwritten.what)  # what ended the checks is told, and counts
            raise
        try:
            self._write("")
        except ConfigError:
            self._tell_a_person(on_the_way=on_the_way)
            raise

    def _tell_a_person(self, *, on_the_way: bool) -> None:
        looked_at = [one for one in self.found if one.error is None]
        if not looked_at:
            return
        if not on_the_way:
            for one in self.broken:
                note(f"{one.name.replace('_', ' ')}: {one.broken}")
        note(
            tr(
                "Of {all} promises {count} were looked at, {broken} of them are broken.",
                all=len(self._checks),
                count=len(looked_at),
                broken=len(self.broken),
            )
        )

    def _write(self, ended_by: str) -> None:
        """Write the file for pipelines: one case a promise.

        Args:
            ended_by: What ended the checks early; empty where they were all made.

        Raises:
            ConfigError: It cannot be written.
        """
        if self._junit is None:
            return
        suite = Xml.Element("testsuite", {"name": f"contract of {_plain(self.identity)}".rstrip()})
        for one in self.found:
            case = _case(suite, one.name)
            if one.error is not None:
                _add(case, "error", one.error.what, one.promise)
            elif one.broken:
                _add(case, "failure", one.broken, one.promise)
        if ended_by and not (self.found and self.found[-1].error is not None):
            self._add_the_end(suite, ended_by)
        for check in self._checks[len(suite) :]:
            _add(_case(suite, check.__name__), "skipped", "not looked at")
        for count, kind in (("tests", "testcase"), ("failures", "testcase/failure")):
            suite.set(count, str(len(suite.findall(kind))))
        for count, kind in (("errors", "testcase/error"), ("skipped", "testcase/skipped")):
            suite.set(count, str(len(suite.findall(kind))))
        Xml.indent(suite)
        if self._junit.exists() and not self._junit.is_file():
            raise _unwritable(self._junit, tr("it is not a regular file"))
        save_named(
            self._junit, Xml.tostring(suite, encoding="utf-8", xml_declaration=True), replace=True
        )

    def _add_the_end(self, suite: Xml.Element, ended_by: str) -> None:
        """Add the check that was ended, or could not begin; behind the last, what came then."""
        names = [check.__name__ for check in self._checks]
        _add(_case(suite, [*names, _END][len(suite)]), "error", ended_by)


def _case(suite: Xml.Element, name: str) -> Xml.Element:
    return Xml.SubElement(suite, "testcase", classname="robolink.contract", name=_plain(name))


def _add(case: Xml.Element, kind: str, message: str, text: str = "") -> None:
    Xml.SubElement(case, kind, message=_plain(message)).text = _plain(text) or None


def _plain(text: str) -> str:
    """Return a text with what no XML document may hold written as an escape."""
    return _NO_XML.sub(lambda found: found[0].encode("unicode_escape").decode("ascii"), text)


def _unwritable(path: Path, cause: str) -> ConfigError:
    return ConfigError(
        tr("{path} cannot be written: {cause}.", path=path, cause=cause),
        remedy=tr("Name another file."),
    )
