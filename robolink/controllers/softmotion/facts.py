"""What a mailbox says about the machine behind it."""

from collections.abc import Mapping
from dataclasses import dataclass

from robolink.controllers.driver_link import MarkedCommand
from robolink.controllers.softmotion.link.answers import describe
from robolink.controllers.softmotion.link.condition import require_still
from robolink.controllers.softmotion.link.mailbox import Mailbox
from robolink.errors import ReadBackError
from robolink.messages import tr
from robolink.model import ControllerFacts
from robolink.protocols.mailbox import (
    Capability,
    Command,
    Kinematics,
    Opcode,
    Response,
    kinematics_word,
)


@dataclass(frozen=True, slots=True)
class MailboxFacts:
    """The machine and the mailbox program.

    Attributes:
        version: Of the mailbox, for example ``1.0``.
        kinematics: Name of the kinematics block.
        orientation_kinematics: Name of the one coupled to it, empty for none.
        axis_count: Axes of the group.
        unit_um: Micrometres in a unit of length.
        capabilities: What the program can be told.
        boot_id: Number of the PLC start.
        device_id: Number of the PLC, drawn once; ``None`` where its program has none.
    """

    version: str
    kinematics: str
    orientation_kinematics: str
    axis_count: int
    unit_um: float
    capabilities: Capability
    boot_id: int
    device_id: int | None

    @classmethod
    def of(cls, now: Response, *, device_id: int | None) -> "MailboxFacts":
        """Return what a snapshot says."""
        return cls(
            version=f"{now.version >> 8}.{now.version & 0xFF}",
            kinematics=block_name(now.position_kinematics),
            orientation_kinematics=block_name(now.orientation_kinematics),
            axis_count=now.axis_count,
            unit_um=now.unit_um,
            capabilities=now.capabilities,
            boot_id=now.boot_id,
            device_id=device_id,
        )

    def shared(self) -> ControllerFacts:
        """Return the same as far as all kinds of controllers share it."""
        blocks = (self.kinematics, self.orientation_kinematics)
        model = " + ".join(name for name in blocks if name)
        return ControllerFacts(
            controller_type="CODESYS SoftMotion",
            controller_serial=None if self.device_id is None else f"{self.device_id:08X}",
            firmware=tr("mailbox {version}", version=self.version),
            robot_models=(model,) if model else (),
        )


def set_kinematics(mailbox: Mailbox, position: Kinematics, orientation: Kinematics) -> None:
    """Put a kinematics in force and prove it; see ``SoftMotionController.set_kinematics``."""
    draft = Command(0, Opcode.SET_KINEMATICS, operands=(position, orientation, 0, 0))
    request, wanted = describe(draft), kinematics_word(position, orientation)
    with mailbox.lock.held(request):
        mailbox.markers.require_settled(request)  # before the mailbox is taken
        now = mailbox.prepare(draft, request)
        require_still(now, controller=mailbox.identity, request=request)
        mailbox.markers.note_selection(0)
        after = mailbox.carry_out(_Change(mailbox, draft, wanted, now.kinematics))
        mailbox.markers.ledger.saw_selected(after.tool_slot)
    if after.kinematics != wanted or after.tool_slot:
        raise ReadBackError(
            tr(
                "The PLC shows kinematics {found:#06x} and tool {tool} after {request!r}.",
                found=after.kinematics,
                tool=after.tool_slot,
                request=request,
            ),
            remedy=tr("Do not move the robot; compare the mailbox program with its codes."),
            controller=mailbox.identity,
            request=request,
        )


class _Change(MarkedCommand[Response]):
    """MC_SetKinTransform."""

    def __init__(self, mailbox: Mailbox, draft: Command, wanted: int, before: int) -> None:
        super().__init__(describe(draft))
        self._mailbox = mailbox
        self._draft = draft
        self._details = {"kinematics": wanted, "before": before}

    @property
    def details(self) -> Mapping[str, object]:
        return self._details

    def send(self) -> None:
        self._mailbox.commands.carry_out(self._draft)

    def read(self) -> Response:
        return self._mailbox.snapshots.take()


def block_name(code: int) -> str:
    """Return the function block of a code; empty for none."""
    try:
        kinematics = Kinematics(code)
    except ValueError:
        return tr("kinematics {code}", code=code)
    return kinematics.block_name or ("" if kinematics is Kinematics.NONE else kinematics.name)
