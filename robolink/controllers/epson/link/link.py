"""What every part of this driver works with: a session, its command window, and its markers."""

from robolink.controllers.driver_link import DriverLink
from robolink.controllers.epson.link.answers import NOT_EXECUTED
from robolink.controllers.epson.link.asked_once import Preferences, RobotFacts
from robolink.controllers.epson.link.identity import IdentityReader
from robolink.controllers.epson.link.session import EpsonSession
from robolink.controllers.epson.link.window import CommandWindow
from robolink.errors import RejectedError
from robolink.model import OutcomeLog


class EpsonLink(DriverLink):
    """One controller that somebody has logged in to.

    Attributes:
        session: Requests and answers.
        window: Statements, as if typed in the controller's command window.
        preferences: What is set in the controller.
        robot: Which robot statements act on.

    Args:
        session: A session that has logged in.
        outcomes: Where doubtful outcomes of this controller are kept.
    """

    def __init__(self, session: EpsonSession, outcomes: OutcomeLog) -> None:
        self.session = session
        self.window = CommandWindow(session)
        self.preferences = Preferences(session)
        self.robot = RobotFacts(self.window)
        self._reader = IdentityReader(session, self.window)
        outcomes.ask(self._reader.read)
        super().__init__(
            session.identity, session.clock, session.latch, outcomes, gate=session.uninterrupted()
        )

    def forget_robot(self) -> None:
        """Ask anew which robot is in force, and whose record it is, when that is needed next."""
        self.robot.forget()
        self.markers.outcomes.ask(self._reader.read)

    def was_not_executed(self, refusal: RejectedError) -> bool:
        """Whether a refusal proves that nothing was done (docs/reference/epson.md 1.6)."""
        return refusal.code in NOT_EXECUTED
