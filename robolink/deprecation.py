"""Public names that were replaced: each works for one more version, and warns.

:data:`OLD_NAMES` is the one list of names that moved; a package with a row in it asks here by
:func:`~robolink.lazy_exports.old_names`. What is found is the thing itself, so ``isinstance``,
``except`` and pickles do not care by which name it was imported. A function or method that was
given up keeps its body and has :func:`deprecated` before it.
"""

import sys
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from functools import wraps
from importlib import import_module
from typing import Final, ParamSpec, TypeVar, cast

GONE_IN: Final = "0.2.0"
"""Version in which the old names of this version are gone; a test reminds whoever releases it."""

OLD_NAMES: Final[Mapping[str, Mapping[str, str]]] = {
    "robolink.ambient": {
        "Ambience": "robolink.runtime.SystemRuntime",
        "WaitingLock": "robolink.runtime.WaitingLock",
        "WaitingRoom": "robolink.runtime.WaitingRoom",
        "boot_ns": "robolink.runtime.boot_ns",
        "lock": "robolink.runtime.lock",
        "monotonic_ns": "robolink.runtime.monotonic_ns",
        "random_bytes": "robolink.runtime.random_bytes",
        "random_number": "robolink.runtime.random_number",
        "reentrant_lock": "robolink.runtime.reentrant_lock",
        "regularly": "robolink.runtime.regularly",
        "replaced": "robolink.runtime.replaced",
        "sleep": "robolink.runtime.sleep",
        "steps_time": "robolink.runtime.steps_time",
        "waiting_room": "robolink.runtime.waiting_room",
        "wall_s": "robolink.runtime.wall_s",
    },
    "robolink.config": {"Problem": "robolink.files.toml.Problem"},
    "robolink.controllers.epson": {
        "EpsonController": "robolink.controllers.EpsonController",
        "EpsonVariables": "robolink.controllers.EpsonVariables",
        "PublishedTools": "robolink.controllers.PublishedTools",
        "ValueReceipt": "robolink.model.ValueReceipt",
        "VariableType": "robolink.protocols.epson_text.VariableType",
        "open_epson": "robolink.controllers.open_epson",
        "typed_value": "robolink.controllers.typed_value",
        "variable_type": "robolink.controllers.variable_type",
    },
    "robolink.controllers.plc_map": {
        "FlangeReader": "robolink.controllers.FlangeReader",
        "PlcMapController": "robolink.controllers.PlcMapController",
        "open_plc_map": "robolink.controllers.open_plc_map",
    },
    "robolink.controllers.softmotion": {
        "Jog": "robolink.controllers.Jog",
        "MailboxFacts": "robolink.controllers.MailboxFacts",
        "SoftMotionController": "robolink.controllers.SoftMotionController",
        "open_softmotion": "robolink.controllers.open_softmotion",
        "read_device_id": "robolink.controllers.read_device_id",
    },
    "robolink.journal": {
        "EntryKind": "robolink.model.EntryKind",
        "LookingLog": "robolink.journal.ReadOnlyLog",
        "NewEntry": "robolink.model.NewEntry",
        "Recorded": "robolink.model.Recorded",
        "Signature": "robolink.model.Signature",
    },
    "robolink.model": {"describe_standing": "robolink.model.describe_outcome"},
    "robolink.nozzle_change": {
        "AcceptanceCriteria": "robolink.calibration_run.AcceptanceCriteria",
        "Attended": "robolink.calibration_run.Attended",
        "ChangePlan": "robolink.calibration_run.ChangePlan",
        "ChangeReport": "robolink.calibration_run.ChangeReport",
        "DescribeReport": "robolink.calibration_run.DescribeReport",
        "Earlier": "robolink.calibration_run.Earlier",
        "LimitVerdict": "robolink.calibration_run.LimitVerdict",
        "Limits": "robolink.calibration_run.Limits",
        "Listener": "robolink.calibration_run.Listener",
        "Moment": "robolink.calibration_run.Moment",
        "NozzleChange": "robolink.calibration_run.NozzleChange",
        "OpenTurnTest": "robolink.calibration_run.OpenTurnTest",
        "PlannedStep": "robolink.calibration_run.PlannedStep",
        "Proposal": "robolink.calibration_run.Proposal",
        "Seating": "robolink.calibration_run.Seating",
        "ToolPlan": "robolink.calibration_run.ToolPlan",
        "ToolReport": "robolink.calibration_run.ToolReport",
        "TurnTestStep": "robolink.calibration_run.TurnTestStep",
        "WriteSubject": "robolink.calibration_run.WriteSubject",
        "accuracy_facts": "robolink.calibration_run.accuracy_facts",
        "assessed_in_cell": "robolink.calibration_run.assessed_in_cell",
        "clearance_too_small": "robolink.calibration_run.clearance_too_small",
        "conclude_turn_test": "robolink.calibration_run.conclude_turn_test",
        "finish_by_turn_test": "robolink.calibration_run.finish_by_turn_test",
        "flange_now": "robolink.calibration_run.flange_now",
        "foresee": "robolink.calibration_run.foresee",
        "height_is_known": "robolink.calibration_run.height_is_known",
        "known_height": "robolink.calibration_run.known_height",
        "next_steps": "robolink.calibration_run.next_steps",
        "open_turn_tests": "robolink.calibration_run.open_turn_tests",
        "preview": "robolink.calibration_run.preview",
        "require_contact_input": "robolink.calibration_run.require_contact_input",
        "require_inside": "robolink.calibration_run.require_inside",
        "require_ready": "robolink.calibration_run.require_ready",
        "seating_of": "robolink.calibration_run.seating_of",
        "tip_sigma_mm": "robolink.calibration_run.tip_sigma_mm",
        "told_of_contradiction": "robolink.calibration_run.told_of_contradiction",
        "touches_made": "robolink.calibration_run.touches_made",
        "touching_as_recorded": "robolink.calibration_run.touching_as_recorded",
        "untested_sentences": "robolink.calibration_run.untested_sentences",
        "usual_box": "robolink.calibration_run.usual_box",
    },
    "robolink.transport": {
        "open_quick_link": "robolink.transport.open_mailbox_link",
    },
    "robolink.protocols.epson_binary": {
        "NEED_DATA": "robolink.protocols.NEED_DATA",
        "Role": "robolink.protocols.Role",
    },
    "robolink.protocols.epson_text": {
        "NEED_DATA": "robolink.protocols.NEED_DATA",
        "Role": "robolink.protocols.Role",
    },
    "robolink.protocols.mailbox": {
        "PROGRAM_FILES": "robolink.protocols.mailbox.exports.PROGRAM_FILES",
        "PlcopenSchema": "robolink.protocols.mailbox.exports.PlcopenSchema",
        "electronic_data_sheet": "robolink.protocols.mailbox.exports.electronic_data_sheet",
        "error_table_csv": "robolink.protocols.mailbox.exports.error_table_csv",
        "plcopen_xml": "robolink.protocols.mailbox.exports.plcopen_xml",
        "program_texts": "robolink.protocols.mailbox.exports.program_texts",
        "register_map_csv": "robolink.protocols.mailbox.exports.register_map_csv",
        "register_map_markdown": "robolink.protocols.mailbox.exports.register_map_markdown",
        "structured_text_types": "robolink.protocols.mailbox.exports.structured_text_types",
    },
    "robolink.protocols.spel_callback": {"NEED_DATA": "robolink.protocols.NEED_DATA"},
    "robolink.procedures": {"CalibratedCameraSource": "robolink.procedures.LookSource"},
    "robolink.recipe": {"RecipeRun": "robolink.calibration_run.RecipeRun"},
    "robolink.register_maps": {"Problem": "robolink.files.toml.Problem"},
    "robolink.standing": {
        "Effect": "robolink.controller_outcome.Effect",
        "Standing": "robolink.controller_outcome.ControllerOutcome",
        "ToolStanding": "robolink.controller_outcome.ToolOutcome",
        "UNTOUCHED": "robolink.controller_outcome.UNTOUCHED",
        "standing_after": "robolink.controller_outcome.outcome_after",
    },
    "robolink.stopping": {"far_end_of": "robolink.transport.far_end_of"},
    "robolink.testing": {
        "MemoryController": "robolink.controllers.SimpleController",
        "MemoryMachine": "robolink.controllers.SimpleMachine",
    },
    "robolink.transaction": {"Jump": "robolink.model.Jump"},
    "robolink_simulators.softmotion.mailbox": {
        "PlcFault": "robolink_simulators.faults.PlcFault",
        "PlcFaultAction": "robolink_simulators.faults.PlcFaultAction",
    },
}
"""Old names and their present ones, by package."""

_GATE: Final = "robolink.lazy_exports"
"""Module whose frames lie between this module and the caller."""

_P = ParamSpec("_P")
_R = TypeVar("_R")
_F = TypeVar("_F", bound=Callable[..., object])


def under_old_name(package: str, name: str) -> object:
    """Return what a package exported under an old name, and warn the caller.

    It is called by the ``__getattr__`` of that package.

    Args:
        package: Its name.
        name: What it is asked for.

    Raises:
        AttributeError: It never handed that out, or does no more.
    """
    new = OLD_NAMES.get(package, {}).get(name)
    if new is None:
        raise AttributeError(f"module {package!r} has no attribute {name!r}")
    home, _, now = new.rpartition(".")
    # On "from package import name" the import system looks the name up first, then asks again.
    depth, asking = 1, sys._getframe(1)  # noqa: SLF001 - as ``warnings`` finds whose line it is
    while asking.f_back is not None and asking.f_globals.get("__name__") == _GATE:
        depth, asking = depth + 1, asking.f_back
    if not asking.f_code.co_filename.startswith("<frozen importlib"):
        warn_of_old_name(f"{package}.{name}", new, depth + 2)
    return getattr(import_module(home), now)


def deprecated(instead: str) -> Callable[[Callable[_P, _R]], Callable[_P, _R]]:
    """Mark a function or a method as deprecated: it still works, and warns.

    Args:
        instead: What to use, as a reader would write it.

    Example:
        >>> from robolink.deprecation import deprecated
        >>> @deprecated("angle_deg")
        ... def angle() -> float:
        ...     return 90.0
        >>> import warnings
        >>> with warnings.catch_warnings(record=True) as told:
        ...     warnings.simplefilter("always")
        ...     angle()
        90.0
        >>> str(told[0].message)
        'angle is now angle_deg. The old name goes in robolink 0.2.0.'
    """

    def marked(old: Callable[_P, _R]) -> Callable[_P, _R]:
        @wraps(old)
        def warned(*args: _P.args, **kwargs: _P.kwargs) -> _R:
            warn_of_old_name(old.__qualname__, instead, 3)
            return old(*args, **kwargs)

        return warned

    return marked


def without_sign(sentence: Callable[_P, _R]) -> Callable[_P, _R]:
    """Mark a sentence function that took the sign before a half width: it still does.

    ``sign``, by name or as the last argument, replaces ``+-`` in what is returned, and warns.
    """
    takes = sentence.__code__.co_argcount

    @wraps(sentence)
    def warned(*args: object, **kwargs: object) -> object:
        said = cast("Callable[..., str | Iterator[str]]", sentence)
        sign = kwargs.pop("sign", args[takes] if len(args) == takes + 1 else None)
        if not isinstance(sign, str):
            return said(*args, **kwargs)
        name = sentence.__name__
        warn_of_old_name(
            f"sign of {name}", "'+-' alone, which whoever shows a sentence may replace", 3
        )
        found = said(*args[:takes], **kwargs)
        if isinstance(found, str):
            return found.replace("+-", sign)
        return (one.replace("+-", sign) for one in found)

    return cast("Callable[_P, _R]", warned)


def read_without_schema(fields: Callable[..., object]) -> Callable[[_F], _F]:
    """Mark the reader of documents that read fields without a schema too: it still does, and warns.

    Args:
        fields: What reads fields alone, and takes ``partial``.
    """

    def marked(reads: _F) -> _F:
        @wraps(reads)
        def warned(kind: type, document: object, **partial: bool) -> object:
            if partial or not (isinstance(document, Mapping) and "schema" in document):
                with suppress(KeyError, TypeError, ValueError, AttributeError):
                    found = fields(kind, document, **partial)
                    old = f"{reads.__name__} without a schema"
                    warn_of_old_name(old, "robolink.model.from_fields", 3)
                    return found
            return reads(kind, document)

        return cast("_F", warned)

    return marked


def old_hook(kind: type, old: str, new: str, adapted: object) -> None:
    """Keep a class working that overrides a hook by its old name, and warn its author.

    A base, which is an ABC, calls it from its ``__init_subclass__``.

    Args:
        kind: The class that derives from the base.
        old: How the hook was called.
        new: How it is called now.
        adapted: The new hook, made of the old one.

    Example:
        >>> import warnings
        >>> from robolink.deprecation import old_hook
        >>> class Base:
        ...     def __init_subclass__(cls):
        ...         old_hook(cls, "_length", "length_mm", lambda self: self._length())
        >>> with warnings.catch_warnings(record=True) as told:
        ...     warnings.simplefilter("always")
        ...     class Part(Base):
        ...         def _length(self):
        ...             return 12.0
        >>> Part().length_mm(), str(told[0].message)
        (12.0, 'Part._length is now length_mm. The old name goes in robolink 0.2.0.')
    """
    if old in vars(kind) and new not in vars(kind):
        warn_of_old_name(f"{kind.__qualname__}.{old}", new, 5)
        setattr(kind, new, adapted)


def warn_of_old_name(old: str, new: str, stacklevel: int) -> None:
    """Warn of a deprecated name.

    Args:
        old: What it was.
        new: What it is now.
        stacklevel: Whose line it is, as :func:`warnings.warn` counts from here.
    """
    warnings.warn(
        f"{old} is now {new}. The old name goes in robolink {GONE_IN}.",
        DeprecationWarning,
        stacklevel=stacklevel,
    )
