"""The connections of the contract's checks: each its own, none on the controller's record."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from importlib import import_module
from pathlib import Path
from sys import path as module_path
from typing import TYPE_CHECKING

import robolink
from robolink.errors import ConfigError, RobolinkError, StoppedError
from robolink.messages import tr
from robolink.stopping import far_end_of, find_note
from robolink_cli.session.context import CliContext
from robolink_cli.session.opening import password_of

if TYPE_CHECKING:
    from robolink.model import Controller, Ledger


class TrialConnections:
    """Connects for each check anew, and lets a second terminal stop what that does.

    The checks open and settle markers on purpose; those go to a record in memory. A stop that
    somebody else gives ends them all: a check releases its own stops only.

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
        self._stopped_by: str | None = None

    def connect(self) -> "Controller":
        """Connect for one check.

        Raises:
            StoppedError: Somebody gave a stop; no further check begins.
            RobolinkError: The controller is not reached.
        """
        self._listening.close()
        if (note := find_note(far_end_of(self._url), "")) is not None:
            # It came while no check had the controller, and went there by itself.
            raise StoppedError(
                note.sentence, remedy=tr("Find out why, then start the checks again.")
            )
        if self._stopped_by is not None:
            raise StoppedError(
                tr("{who} stopped the checks.", who=self._stopped_by),
                remedy=tr("Find out why, then start the checks again."),
            )
        controller = robolink.connect(
            self._url,
            password=self._password,
            timeout_s=self._context.timeout_s,
            remote_timeout_s=self._context.remote_timeout_s,
            outcomes=self._record,
        )
        self.ledgers.append(controller.ledger)
        self._listening.enter_context(self._heard_while(controller))
        return controller

    def close(self) -> None:
        """Listen no longer, and forget what an interrupted check left begun. Idempotent."""
        from robolink.journal import forget_memory

        self._listening.close()
        forget_memory(self._identity)

    @contextmanager
    def _heard_while(self, controller: "Controller") -> Iterator[None]:
        from robolink.stopping import StopListener

        with ExitStack() as stack:
            if "+sim://" not in self._url:
                # Where there is no place to listen, Ctrl-C is left, as the command's page says.
                with suppress(OSError):
                    stack.enter_context(
                        StopListener(
                            controller,
                            self._url,
                            who=tr("the checks of the contract"),
                            heard=self._hear,
                        )
                    )
            yield

    def _hear(self, who: str) -> None:
        self._stopped_by = who


def driver_named(name: str) -> "Callable[[], Controller]":
    """Return what makes a controller of somebody's own: ``module:name`` of a class or function.

    Raises:
        ConfigError: There is no such module or name, or nothing that can be called.
    """
    module, colon, attribute = name.partition(":")
    if not (colon and module and attribute):
        raise ConfigError(
            tr("{name!r} is not the name of a driver.", name=name),
            remedy=tr("Write for example {example}.", example="my_package.driver:connect"),
        )
    if str(Path.cwd()) not in module_path:
        module_path.append(str(Path.cwd()))
    try:
        made = getattr(import_module(module), attribute)
    except (Exception, SystemExit) as error:  # it is somebody else's code that runs here
        ours = isinstance(error, (ImportError, AttributeError))
        cause = str(error) if ours else f"{type(error).__name__}: {error}"
        raise ConfigError(
            tr("The driver {name!r} cannot be loaded: {cause}.", name=name, cause=cause),
            remedy=tr("It is looked for in the present folder and among installed packages."),
        ) from error
    if not callable(made):
        raise ConfigError(
            tr("{name!r} cannot be called.", name=name),
            remedy=tr("Name a class or a function that takes nothing and gives a controller."),
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
    """Tell an error that is not one of robolink's as the driver's, before any check is made.

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
        tr("The driver {name!r} gives no controller: {cause}.", name=name, cause=cause),
        remedy=tr("Name a class or a function that takes nothing and gives a controller."),
    )
