"""The options of a simulated PLC as text, from a URL or a command line."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Final

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink_simulators.option_values import require_known, values_from_text
from robolink_simulators.softmotion.mailbox.image import require_places
from robolink_simulators.softmotion.mailbox.options import MailboxOptions
from robolink_simulators.softmotion.options import GroupOptions, SmcNumbers

_NUMBERS: Final = "numbers."
_LONGEST_CYCLE_US: Final = 1_000_000
_LARGEST_UDINT: Final = 0xFFFF_FFFF


@dataclass(frozen=True, slots=True)
class PlcOptions:
    """All options of a simulated PLC, besides its machine.

    Attributes:
        group: The axis group's habits.
        mailbox: The mailbox program and its fieldbus.
    """

    group: GroupOptions = field(default_factory=GroupOptions)
    mailbox: MailboxOptions = field(default_factory=MailboxOptions)


def option_names() -> tuple[str, ...]:
    """Return every option; error numbers are written ``numbers.NAME``."""
    own = [it.name for kind in (MailboxOptions, GroupOptions) for it in fields(kind)]
    own.remove("numbers")
    return (*own, *(_NUMBERS + it.name for it in fields(SmcNumbers)))


def options_from_text(pairs: Mapping[str, str]) -> PlcOptions:
    """Return the defaults with ``pairs`` applied.

    Raises:
        ConfigError: An option is unknown, or a value does not fit it.
    """
    require_known(pairs, option_names(), kind="PLC")
    numbers = replace(SmcNumbers(), **values_from_text(SmcNumbers, pairs, prefix=_NUMBERS))
    group = replace(GroupOptions(), **values_from_text(GroupOptions, pairs), numbers=numbers)
    mailbox = replace(MailboxOptions(), **values_from_text(MailboxOptions, pairs))
    for name, value in (
        ("unit_um", mailbox.unit_um),
        ("program_cycle_us", mailbox.program_cycle_us),
        ("cycle_us", group.cycle_us),
    ):
        _require_positive(name, value)
    if mailbox.device_id > _LARGEST_UDINT:
        raise ConfigError(
            tr("No PLC has the number {device_id}.", device_id=mailbox.device_id),
            remedy=tr("Give device_id from 1 to {most}; 0 draws one.", most=_LARGEST_UDINT),
        )
    require_places(mailbox)
    return PlcOptions(group, mailbox)


def _require_positive(name: str, value: float) -> None:
    if not 0 < value <= _LONGEST_CYCLE_US:
        raise ConfigError(
            tr("The option {name} cannot be {value!r}.", name=name, value=value),
            remedy=tr("Give a number above 0, up to {most}.", most=_LONGEST_CYCLE_US),
        )


def parameters_from_text(pairs: Mapping[str, str]) -> dict[str, float]:
    """Return the parameters as numbers; names and ranges are checked where a machine is made.

    Raises:
        ConfigError: A value is no decimal number.
    """
    return {name: _number(name, text) for name, text in pairs.items()}


def _number(name: str, text: str) -> float:
    try:
        return float(text)
    except ValueError as error:
        raise ConfigError(
            tr("The parameter {name} cannot be {value!r}.", name=name, value=text),
            remedy=tr("Give a decimal number, for example {name}=250.5.", name=name),
        ) from error
