"""What only some kinds of controllers have: inputs and outputs, points, variables, alarms."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

from robolink.model.motion.geometry import Pose

Value = bool | int | float | str
ValueT = TypeVar("ValueT", bound=Value)


@dataclass(frozen=True, slots=True)
class ValueReceipt(Generic[ValueT]):
    """What setting a value did.

    Attributes:
        request: The request, as it stands on the wire.
        before: What was there.
        requested: What was asked for.
        read_back: What is there now.
        skipped: It was there already, so nothing was sent.
    """

    request: str
    before: ValueT
    requested: ValueT
    read_back: ValueT
    skipped: bool


class DigitalIo(Protocol):
    """Inputs and outputs by number."""

    def read_input(self, bit: int) -> bool:
        """Read one input."""

    def set_output(self, bit: int, on: bool) -> ValueReceipt[bool] | None:
        """Switch one output, and prove it as far as this controller lets it be proved.

        Returns:
            ``None`` where an output cannot be read back: the acknowledgement is the proof.

        Raises:
            NotReadyError: The state forbids it.
            RejectedError: It was refused; nothing was switched.
            OutcomeUnknownError: No answer came; motion is blocked until ``recover``.
        """

    def preview_output(self, bit: int, on: bool) -> tuple[str, ...]:
        """Return what :meth:`set_output` would send, as it stands on the wire."""


class PointReader(Protocol):
    """The taught points of a controller."""

    def read_all(self, numbers: Iterable[int]) -> Mapping[int, Pose | None]:
        """Read some of them; an undefined one is ``None``."""


class VariableTable(Protocol):
    """Variables of the program in a controller, by name and by the name of their type."""

    def read(self, name: str, kind: str) -> Value:
        """Read one variable."""

    def write(self, name: str, value: Value, kind: str) -> ValueReceipt[Value]:
        """Set one variable and read it back; raises like :meth:`DigitalIo.set_output`.

        Args:
            name: Name of the variable, as the project of the controller has it.
            value: What it is to hold.
            kind: Its type, such as ``Real``.

        Example:
            >>> import robolink
            >>> from robolink.protocols.epson_text import VariableType
            >>> from robolink_simulators.epson import EpsonSimulator
            >>> from robolink_simulators.hosting.in_process.epson import register
            >>> simulator = EpsonSimulator()
            >>> simulator.variables.declare("g_height", VariableType.REAL)
            >>> with robolink.connect(register("variable-example", simulator)) as controller:
            ...     receipt = controller.variables.write("g_height", 2.5, "Real")
            >>> receipt.before, receipt.read_back
            (0.0, 2.5)
        """

    def preview_write(self, name: str, value: Value, kind: str) -> tuple[str, ...]:
        """Return what :meth:`write` would send besides its reads; reads only.

        Args:
            name: Name of the variable.
            value: What it would hold.
            kind: Its type.

        Example:
            >>> import robolink
            >>> from robolink_simulators.epson import EpsonSimulator
            >>> from robolink_simulators.hosting.in_process.epson import register
            >>> simulator = EpsonSimulator()
            >>> simulator.variables.declare("g_height", "real")
            >>> with robolink.connect(register("preview-example", simulator)) as controller:
            ...     controller.variables.preview_write("g_height", 2.5, "real")
            ('$SetVariable,g_height,2.5,Real',)
        """


class AlarmList(Protocol):
    """What a controller wants looked after, apart from errors."""

    def list(self) -> tuple[int, ...]:
        """Read the numbers of the alarms that stand.

        Raises:
            RejectedError: This firmware does not tell them.
        """

    def reset(self, number: int) -> None:
        """Reset one because a person asked for it, and prove that it is gone."""
