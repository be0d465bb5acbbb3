"""An axis group of a CODESYS SoftMotion PLC behind its mailbox, and connecting to one."""

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar, Final

from robolink import runtime
from robolink.controllers.controller_core import ControllerCore
from robolink.controllers.registry import ConnectionTerms
from robolink.controllers.softmotion.answers import describe
from robolink.controllers.softmotion.condition import condition_of, status_of
from robolink.controllers.softmotion.facts import MailboxFacts, set_kinematics
from robolink.controllers.softmotion.group import SoftMotionGroup
from robolink.controllers.softmotion.kinematics import OrientationImages
from robolink.controllers.softmotion.mailbox import Mailbox, SoftMotionIo, read_device_id
from robolink.controllers.softmotion.ownership import take_command
from robolink.controllers.softmotion.rest import stop_over_new_link
from robolink.controllers.softmotion.snapshots import Snapshots
from robolink.controllers.softmotion.tools import SoftMotionResolver, SoftMotionToolTable
from robolink.controllers.softmotion.wire import MailboxWire
from robolink.controllers.stop_attempts import anew
from robolink.errors import Concerning, ConfigError, ControllerFaultError, LeaseHeldError
from robolink.messages import tr
from robolink.model import (
    Act,
    Capabilities,
    Controller,
    ControllerFacts,
    ControllerStatus,
    EntryKind,
    MarkerKind,
    NewEntry,
    OutcomeLog,
    is_custom,
)
from robolink.protocols.mailbox import (
    Capability,
    Command,
    GroupState,
    Kinematics,
    Opcode,
    Response,
)
from robolink.timing import AnswerTimes, Deadline
from robolink.transport import LinkUrl, MailboxLink, open_mailbox_link

if TYPE_CHECKING:  # pyright does not accept a cached_property as a property of Controller
    from builtins import property as cached_property
else:
    from functools import cached_property


if TYPE_CHECKING:
    from robolink.controllers.softmotion.facts import MailboxFinding


_RELEASE: Final = (GroupState.STOPPING, Command(0, Opcode.STOP, operands=(1, 0, 0, 0)))
"""The command that releases a stop which holds the group."""

_RESETS: Final = ((GroupState.ERRORSTOP, Command(0, Opcode.RESET)), _RELEASE)
"""Commands that lead out of a state of the group; after an error, a stop may still be active."""

_SIMULATED: Final = "sim"

MACHINE_WAITS: Final = "machine_waits"
"""Key in the marker of a change: the machine's program continues once the mailbox is released."""

_LEAVING_S: Final = 1.0
"""Longest time from the end of a reset to the next state, in s."""


class SoftMotionController(ControllerCore):
    """A connected PLC mailbox. Use it as a context manager.

    The mailbox is owned from the first command that needs it until :meth:`close`; reading the
    state, the position and the tool slots needs no ownership. A stop holds the group on the PLC
    until :meth:`release_hold` or :meth:`reset_fault`. The profile ``tools`` of the mailbox program
    moves nothing.

    Attributes:
        tools: Slots 1 to 15.
        groups: The one axis group of this mailbox.

    Args:
        mailbox: The mailbox.
        images: What is known of the machine builder's own kinematics.
        acceleration_mm_s2: Highest acceleration of straight movements, as the cell states it;
            ``None`` leaves what robolink sends with each of them.

    Example:
        >>> import robolink
        >>> from robolink.controllers import SoftMotionController
        >>> url = "softmotion+sim://controller-example"
        >>> with robolink.connect(url, kind=SoftMotionController, acceleration_mm_s2=150) as plc:
        ...     round(plc.groups[0].run_up_mm(10), 2)  # in mm
        0.35
    """

    OF_KIND: ClassVar = Capabilities(
        pose_while_moving=True,
        tool_write=True,
        motion=True,
        motors=True,
        acceleration=True,
        io=True,
    )
    tools: SoftMotionToolTable
    groups: tuple[SoftMotionGroup]

    def __init__(
        self,
        mailbox: Mailbox,
        images: OrientationImages | None = None,
        *,
        acceleration_mm_s2: int | None = None,
    ) -> None:
        self._mailbox = mailbox
        self.groups = (SoftMotionGroup(mailbox, acceleration_mm_s2=acceleration_mm_s2),)
        able = mailbox.snapshots.met.capabilities
        moves = Capability.MOTION in able
        offered = replace(
            self.OF_KIND,
            tool_write=Capability.TOOLS in able,
            motion=moves,
            motors=moves,
            acceleration=moves,
        )
        tools = SoftMotionToolTable(mailbox, images)
        super().__init__(mailbox, capabilities=offered, tools=tools)

    @cached_property
    def io(self) -> SoftMotionIo:
        """Inputs and outputs."""
        return SoftMotionIo(self._mailbox)

    @cached_property
    def resolver(self) -> SoftMotionResolver:
        """Finishes or undoes interrupted jobs."""
        return SoftMotionResolver(self._mailbox, self.tools, self._preserver)

    @property
    def device_id(self) -> int | None:
        """The number that the PLC drew once, the same on every link; ``None`` where it has none."""
        return self._mailbox.device_id

    @property
    def exchanges(self) -> int:
        """Requests sent so far."""
        return self._mailbox.wire.exchanges

    @property
    def answers(self) -> AnswerTimes:
        """How long it takes to answer."""
        return self._mailbox.wire.answers

    def _read_status(self) -> ControllerStatus:
        # Reading the status sends no heartbeat: a movement or jog ends unless somebody waits on it.
        return status_of(self._mailbox.snapshots.take())

    def facts(self) -> ControllerFacts:
        """Read which machine this is, in the words that all kinds of controllers share."""
        return self.mailbox_facts().shared()

    def mailbox_facts(self) -> MailboxFacts:
        """Read which machine and which mailbox program this is."""
        return MailboxFacts.of(self._mailbox.snapshots.take(), device_id=self.device_id)

    def verify(self) -> "tuple[MailboxFinding, ...]":
        """Check everything that can be seen without a command; nothing is written."""
        from robolink.controllers.softmotion.facts import verify_mailbox

        return verify_mailbox(self._mailbox)

    def condition(self) -> dict[str, object]:
        """Read the meaning of an error, the selected tool, and what else the mailbox shows."""
        return condition_of(self._mailbox.snapshots.take())

    def preview(self, act: Act) -> tuple[str, ...]:
        """Return the commands of an action, in words; those of a reset depend on the state."""
        if act is Act.RESET:
            state = self._mailbox.snapshots.take().group_state
            return tuple(describe(draft) for wrong, draft in _RESETS if wrong == state)
        opcodes = {
            Act.STOP: Opcode.STOP,
            Act.MOTORS_ON: Opcode.ENABLE,
            Act.MOTORS_OFF: Opcode.DISABLE,
        }
        return (describe(Command(0, opcodes[act])),)

    def preview_take(self, *, insist: bool = False) -> str:
        """Return what :meth:`take` would send, in words."""
        return describe(take_command(insist=insist))

    def take(self, *, insist: bool = False, patient: bool = True) -> None:
        """Take the mailbox now, before the first command that needs it.

        Args:
            insist: A person who sees the cell wants it, whoever owns it now.
            patient: Whether the ten seconds of a run that has ended are waited for.

        Raises:
            LeaseHeldError: Another client owns it.
        """
        self._mailbox.commands.ownership.take(insist=insist, patient=patient)

    def take_over(self, reason: str) -> None:
        """Take record and mailbox over at a person's request; see the model.

        What the owner of the mailbox has under way is ended by the PLC in that cycle.
        """
        super().take_over(reason)
        try:
            self.take(patient=False)
        except LeaseHeldError as held:
            self.outcomes.append(
                NewEntry(
                    EntryKind.LEASE,
                    verdict=tr(
                        "the mailbox was taken from client {holder}: {reason}",
                        holder=held.holder,
                        reason=reason,
                    ),
                    details={"taken_from": held.holder, "reason": reason},
                )
            )
            self.take(insist=True)

    def reset_fault(self) -> None:
        """Clear the group's error and release a stop, at a person's request.

        Nothing is sent where there is nothing to reset: SoftMotion calls that an error
        (docs/reference/softmotion.md 2.2).

        Raises:
            NotReadyError: The machine does not permit it.
            ControllerFaultError: The error is still there afterwards.
        """
        with self._mailbox.lock.held(tr("reset"), calming=True):
            now = self._led_out(_RESETS)
            if any(now.group_state == state for state, _draft in _RESETS):
                raise ControllerFaultError(
                    tr("The axis group is still in the same state after the reset."),
                    code=now.error_class,
                    remedy=tr("Remove the cause at the drives or the machine, then reset again."),
                )

    def release_hold(self) -> bool:
        """Release what a stop holds on the PLC, at a person's request; return whether it held.

        No error is cleared, and nothing moves: the group may be moved again. Nothing is sent where
        no stop holds it.

        Raises:
            NotReadyError: The machine does not permit it.
            LeaseHeldError: Another client owns the mailbox.
            ControllerFaultError: The group is held still: not by a stop of the mailbox.
        """
        with self._mailbox.lock.held(tr("release of the stop"), calming=True):
            if self._mailbox.snapshots.take().group_state != GroupState.STOPPING:
                return False
            now = self._led_out((_RELEASE,))
            if now.group_state == GroupState.STOPPING:
                raise ControllerFaultError(
                    tr("The release did not free the axis group."),
                    code=now.error_class,
                    remedy=tr("Find what holds it: the machine's own program, or a stop button."),
                )
            return True

    def motors(self, on: bool) -> None:
        """Enable or disable the group, and confirm it; the PLC's program switches the drives."""
        if on:
            self.groups[0].enable()
        else:
            self.groups[0].disable()

    def set_kinematics(
        self, position: Kinematics, orientation: Kinematics = Kinematics.NONE
    ) -> None:
        """Select another kinematics (MC_SetKinTransform), and confirm it.

        The tool is identity and no slot is selected afterwards (docs/reference/softmotion.md 1.1).

        Raises:
            NotReadyError: The group moves, or the machine does not permit it.
            RejectedError: The PLC refused it.
            ReadBackError: Another kinematics is in force.
            OutcomeUnknownError: An earlier job is unfinished, or no answer came.
        """
        set_kinematics(self._mailbox, position, orientation)

    def _take_leave(self) -> None:
        """Halt what nobody waited on, and release the mailbox.

        A machine that called takes that for the word that its tool is settled
        (docs/plc-callback.md), so while such a change is open the mailbox stays taken.
        """
        if self._mailbox.wire.alive:
            self.groups[0].abort_unfinished()
            if not self._mailbox.wire.epoch or not self._machine_waits():
                self._mailbox.commands.ownership.release()

    def _machine_waits(self) -> bool:
        return any(
            marker.kind is MarkerKind.CHANGE and marker.details.get(MACHINE_WAITS) is True
            for marker in self.outcomes.open_markers()
        )

    def _close_link(self) -> None:
        self._mailbox.wire.close()

    def _led_out(self, resets: tuple[tuple[GroupState, Command], ...]) -> Response:
        """Send, in this order, what leads out of each state that the group is in."""
        mailbox = self._mailbox
        now = mailbox.snapshots.take()
        for state, draft in resets:
            if now.group_state == state:
                mailbox.prepare(draft, describe(draft))
                mailbox.commands.ownership.require(describe(draft))
                now = self._left(state, mailbox.commands.carry_out(draft))
        return now

    def _left(self, state: GroupState, now: Response) -> Response:
        """Give the group the cycles that it needs to leave a state.

        Source: docs/reference/softmotion.md 2.2.
        """
        deadline = Deadline.after(self.clock, _LEAVING_S)
        while now.group_state == state and not deadline.expired:
            now = self._mailbox.snapshots.news(now)
        return now


def open_softmotion_url(url: LinkUrl, terms: ConnectionTerms, /) -> Controller:
    """Connect to the PLC at a URL; see :class:`~robolink.controllers.ControllerOpener`.

    Raises:
        RobolinkError: As :func:`open_softmotion`, and as the link.
    """
    url, kinematics = _own_kinematics(url)
    link = open_mailbox_link(
        url, timeout_s=terms.timeout_s, clock=terms.clock, password=terms.password
    )
    controller = open_softmotion(
        link,
        outcomes=terms.record_of(link),
        timeout_s=terms.timeout_s,
        kinematics=kinematics,
        acceleration_mm_s2=terms.acceleration_mm_s2,
        tell=terms.tell,
    )
    controller.stops_anew(anew(stop_over_new_link, url, terms))
    return controller


def _own_kinematics(url: LinkUrl) -> tuple[LinkUrl, str]:
    """Return a URL for its link, and the class of the machine builder's own kinematics."""
    # An unescaped plus sign has become a space.
    named = url.options.get("kinematics", "").replace(" ", "+")
    if url.medium == _SIMULATED:
        return url, named if is_custom(named) else ""
    if named and not is_custom(named):
        raise ConfigError(
            tr("The PLC itself reports that its kinematics is {name}.", name=named),
            remedy=tr("Leave kinematics out, or name your own class as module:Class."),
        )
    options = {name: value for name, value in url.options.items() if name != "kinematics"}
    return replace(url, options=options), named


def open_softmotion(
    link: MailboxLink,
    *,
    outcomes: OutcomeLog,
    timeout_s: float = 3.0,
    owner: int = 0,
    kinematics: str | tuple[object, ...] = (),
    acceleration_mm_s2: int | None = None,
    tell: Callable[[str], None] = lambda _sentence: None,
) -> SoftMotionController:
    """Connect to the mailbox and return the controller; the link is closed if that fails.

    Nothing is written: whoever only reads disturbs nobody.

    Args:
        link: An open link; the controller owns it from here on.
        outcomes: Where doubtful outcomes of this PLC are kept.
        timeout_s: Longest wait for the PLC to acknowledge a command.
        owner: This client's token; by default one that nobody else has.
        kinematics: The machine builder's own, as ``module:Class`` or as objects, so that a tool
            that it cannot carry is refused before it is written (docs/custom-kinematics.md).
        acceleration_mm_s2: Highest acceleration of straight movements, as the cell states it.
        tell: Told, in sentences, what is waited for.

    Raises:
        ConnectError: The mailbox program does not run.
        RemoteProtocolError: It is no mailbox of this version, or its words stand elsewhere.

    Example:
        >>> from robolink.controllers import open_softmotion
        >>> from robolink.journal import memory_journal
        >>> from robolink.transport import open_mailbox_link
        >>> link = open_mailbox_link("softmotion+sim://mailbox-example")
        >>> log = memory_journal("mailbox-example").log("mailbox-example")
        >>> with open_softmotion(link, outcomes=log) as controller:
        ...     controller.groups[0].name
        'axis group'
    """
    wire = MailboxWire(link, owner=owner or runtime.random_number(32), timeout_s=timeout_s)
    try:
        with Concerning(link.identity):
            snapshots = Snapshots(wire)
            snapshots.meet()
            device_id = read_device_id(wire)
            mailbox = Mailbox(wire, snapshots, outcomes, device_id=device_id, tell=tell)
            images = OrientationImages(kinematics)
            return SoftMotionController(mailbox, images, acceleration_mm_s2=acceleration_mm_s2)
    except BaseException:
        wire.close()
        raise
