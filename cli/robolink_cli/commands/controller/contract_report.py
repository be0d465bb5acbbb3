"""What the contract checks found, reported whatever ends them: to people and to pipelines."""

import re
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Final
from xml.etree import ElementTree as Xml

import robolink
from robolink import runtime
from robolink.errors import ConfigError, RobolinkError, StoppedError, TransportClosedError
from robolink.files.named import save_named
from robolink.messages import tr
from robolink.model import ControllerStatus
from robolink.stopping import find_note
from robolink.transport import far_end_of
from robolink_cli.access.cell import acceleration_of
from robolink_cli.access.record import recording
from robolink_cli.console.exit_codes import error_body
from robolink_cli.console.render import note
from robolink_cli.session.connection import password_of
from robolink_cli.session.context import CliContext

if TYPE_CHECKING:
    from robolink.model import Controller, Ledger
    from robolink.testing import Check, CheckOutcome
    from robolink.transport import TraceSink


_NO_XML: Final = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""Characters that an XML document cannot contain, even escaped. A driver's texts may contain them.
"""

_END: Final = "what_was_there_is_put_back"
"""Name of the test case that reports what ended the checks, if the last check had passed."""


class ContractReport:
    """Collects the result of each promise.

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
        """Surround the checks: whatever ends the block, the progress is reported.

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
                note(unwritten.what)  # only a note: the error that ended the checks is raised
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
                "{count} of {all} checks were made, {broken} failed.",
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
        """Add the check that was ended, or could not start; after the last one, what followed."""
        names = [check.__name__ for check in self._checks]
        _add(_case(suite, [*names, _END][len(suite)]), "error", ended_by)


def _case(suite: Xml.Element, name: str) -> Xml.Element:
    return Xml.SubElement(suite, "testcase", classname="robolink.contract", name=_plain(name))


def _add(case: Xml.Element, kind: str, message: str, text: str = "") -> None:
    Xml.SubElement(case, kind, message=_plain(message)).text = _plain(text) or None


def _plain(text: str) -> str:
    """Return a text with characters that XML does not allow written as escapes."""
    return _NO_XML.sub(lambda found: found[0].encode("unicode_escape").decode("ascii"), text)


def _unwritable(path: Path, cause: str) -> ConfigError:
    return ConfigError(
        tr("{path} cannot be written: {cause}.", path=path, cause=cause),
        remedy=tr("Name another file."),
    )


class TrialConnections:
    """Connects for each check anew, and lets a second terminal stop it.

    The checks open and settle markers on purpose; those go to a record in memory. A stop that
    somebody else gives ends them all, and is heard between two checks too: a check releases its
    own stops only.

    Args:
        context: What the command was told.

    Attributes:
        ledgers: What each connection did so far, in their order.
    """

    def __init__(self, context: CliContext) -> None:
        from robolink.journal import memory_journal
        from robolink.model import Signature

        self.ledgers: list[Ledger] = []
        self._context = context
        self._url, self._password = context.require_url(), password_of(context)
        self._identity = f"contract-check:{self._url.partition('?')[0]}"
        self._record = memory_journal(self._identity).log(self._identity, signature=Signature())
        self._listening = ExitStack()
        self._trace: TraceSink | None = None
        self._lock = runtime.lock()
        self._latest: Controller | None = None
        self._stopped = False
        self._stopped_by = ""
        self._state = ControllerStatus()

    def connect(self) -> "Controller":
        """Connect for one check.

        Raises:
            StoppedError: Somebody gave a stop; no further check begins.
            RobolinkError: The controller is not reached.
        """
        with self._lock:
            self._require_no_stop()
            if not self.ledgers:
                far_end = self._url.partition("?")[0]
                kept = recording(self._context.record, far_end)
                self._trace = self._listening.enter_context(kept)
            self._latest = controller = self._connected()
            self.ledgers.append(controller.ledger)
            if len(self.ledgers) == 1:
                self._listen()
        return controller

    def close(self) -> None:
        """Listen no longer, and forget what an interrupted check left open. Idempotent."""
        from robolink.journal import forget_memory

        self._listening.close()
        forget_memory(self._identity)

    def stop(self) -> None:
        """Stop the controller, whether a check has it now or none does; any thread."""
        self._stopped = True
        with self._lock:  # wait for a connection in progress: it is the one to stop
            controller = self._latest
        if controller is not None:
            with suppress(TransportClosedError):  # the check has ended
                controller.stop()
                self._state = controller.status()
                return
        with self._lock, self._connected() as own:
            own.stop()
            self._state = own.status()

    def status(self) -> ControllerStatus:
        """Return the state that the stop has shown."""
        return self._state

    def _require_no_stop(self) -> None:
        note = find_note(far_end_of(self._url), "")
        if note is not None:
            # The stop came while no check used the controller, and was sent separately.
            what = note.sentence
        elif self._stopped_by:
            what = tr("{who} stopped the checks.", who=self._stopped_by)
        elif self._stopped:
            what = tr("The checks were stopped from another terminal.")
        else:
            return
        raise StoppedError(what, remedy=tr("Find out why, then start the checks again."))

    def _connected(self) -> "Controller":
        return robolink.connect(
            self._url,
            password=self._password,
            timeout_s=self._context.timeout_s,
            remote_timeout_s=self._context.remote_timeout_s,
            acceleration_mm_s2=acceleration_of(self._context.cell),
            trace=self._trace,
            outcomes=self._record,
        )

    def _listen(self) -> None:
        from robolink.stopping import StopListener

        if "+sim://" in self._url:
            return
        who = tr("the contract checks")
        # Without a place to listen, only Ctrl-C remains, as the command's page says.
        with suppress(OSError):
            self._listening.enter_context(StopListener(self, self._url, who=who, heard=self._hear))

    def _hear(self, who: str) -> None:
        self._stopped_by = who


def driver_named(name: str) -> "Callable[[], Controller]":
    """Return the function that makes a user's own controller: ``module:name``.

    Raises:
        ConfigError: There is no such module or name, or nothing that can be called.
    """
    module, colon, attribute = name.partition(":")
    if not (colon and module and attribute):
        raise ConfigError(
            tr("{name!r} is not the name of a driver.", name=name),
            remedy=tr("Write for example {example}.", example="my_package.driver:connect"),
        )
    if str(Path.cwd()) not in sys.path:
        sys.path.append(str(Path.cwd()))
    try:
        made = getattr(import_module(module), attribute)
    except (Exception, SystemExit) as error:  # this runs third-party code
        ours = isinstance(error, (ImportError, AttributeError))
        cause = str(error) if ours else f"{type(error).__name__}: {error}"
        raise ConfigError(
            tr("The driver {name!r} cannot be loaded: {cause}.", name=name, cause=cause),
            remedy=tr("robolink searches the present folder and the installed packages."),
        ) from error
    if not callable(made):
        raise ConfigError(
            tr("{name!r} cannot be called.", name=name),
            remedy=tr("Name a class or function that takes no arguments and returns a controller."),
        )

    def connect() -> "Controller":
        with told_of_the_driver(name):
            controller: Controller = made()
        missing = {"__enter__", "capabilities", "status", "tools"}.difference(dir(controller))
        if missing:
            raise _no_controller(name, f"{type(controller).__name__} has no {min(missing)}")
        return controller

    return connect


@contextmanager
def told_of_the_driver(name: str) -> Iterator[None]:
    """Report an error that is not robolink's as the driver's, before any check is made.

    Raises:
        ConfigError: There was one.
    """
    try:
        yield
    except RobolinkError:
        raise
    except (Exception, SystemExit) as error:
        raise _no_controller(name, f"{type(error).__name__}: {error}") from error


def _no_controller(name: str, cause: str) -> ConfigError:
    return ConfigError(
        tr("The driver {name!r} returned no controller: {cause}.", name=name, cause=cause),
        remedy=tr("Name a class or function that takes no arguments and returns a controller."),
    )
