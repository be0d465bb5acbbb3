"""The parameters of camera."""

from dataclasses import dataclass

from robolink.messages import tr
from robolink.methods.declaration.look_parameters import LookParameters


@dataclass(frozen=True, kw_only=True)
class CameraParameters(LookParameters):
    """How a calibrated camera looks at a tip."""

    def no_residual(self) -> str:
        """Return why residuals cannot be judged, empty when they can."""
        if len(self.turns_deg) > 2:
            return ""
        return tr(
            "cannot be judged: looks at one or two angles cannot check each other; "
            "look at three angles or more, or limit the interval and state the "
            "standard deviation"
        )
