"""The inputs that a map names."""

from typing import NoReturn

from robolink.controllers.plc_map.registers import Registers
from robolink.errors import ConfigError, RejectedError
from robolink.messages import tr
from robolink.register_maps import RegisterMap


class MappedInputs:
    """Reads inputs by the number that the map gives them."""

    def __init__(self, registers: Registers, register_map: RegisterMap) -> None:
        self._registers = registers
        self._inputs = register_map.inputs

    def names(self) -> dict[int, str]:
        """Return the inputs of the map and what people call them."""
        return {number: one.name for number, one in self._inputs.items()}

    def read_input(self, bit: int) -> bool:
        """Read one input.

        Raises:
            ConfigError: The map has no such input.
        """
        if bit not in self._inputs:
            raise ConfigError(
                tr("The map has no input {number}.", number=bit),
                remedy=tr(
                    "These are known: {numbers}.",
                    numbers=", ".join(map(str, self._inputs)) or tr("none"),
                ),
            )
        return self._registers.is_on(self._inputs[bit].signal)

    def set_output(self, bit: int, on: bool) -> NoReturn:  # noqa: ARG002 - the model's form
        """Refuse: a map has no outputs.

        Raises:
            RejectedError: Always.
        """
        raise RejectedError(
            tr("Output {number} was not switched: a PLC map has no outputs.", number=bit),
            remedy=tr("Switch it at the machine."),
            controller=self._registers.identity,
        )

    def preview_output(self, bit: int, on: bool) -> NoReturn:
        """Refuse; see :meth:`set_output`."""
        self.set_output(bit, on)
