"""Whether a place can be taken, as far as a face knows. The runner decides."""

from robolink.messages import tr
from robolink.runner import SETTLING_S
from robolink_cli.wizard.state import LEAST_WAY_MM, WizardState


def not_yet(state: WizardState, at_s: float) -> str:
    """Return why the place is refused so far, as known here; empty for nothing."""
    touch, jogging = state.touch, state.jogging
    if touch is None:
        return ""
    if at_s - jogging.ended_s < SETTLING_S:
        return tr("Wait: the robot is still moving.")
    arrived = touch.arrival is not None or state.carried
    if touch.contact is None and arrived and not _brought(state):
        return tr("Not yet: the tip is still where the robot stopped. Jog it onto the pin.")
    if touch.contact is None and jogging.coarse:
        return tr(
            "Not yet: the last step was {mm} mm. Finish with 0.10 mm or less.",
            mm=f"{jogging.longest:.2f}",
        )
    reading = state.reading
    if reading is not None and at_s - reading.at_s > 1.0:
        return tr("No reading from the controller for {s} s.", s=round(at_s - reading.at_s))
    return ""


def _brought(state: WizardState) -> bool:
    """Return whether the tip was moved from where the robot stopped."""
    way = state.way_mm()
    if way is None:
        return state.jogging.steps > 0
    return max(map(abs, way)) >= LEAST_WAY_MM / 2 and state.jogging.steps > 0
