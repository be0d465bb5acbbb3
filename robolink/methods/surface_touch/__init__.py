"""What plane-touch and sphere-touch share: a surface touched upright and tilted."""

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any, Generic, Self

from annotated_types import Ge, Le

from robolink.messages import declared
from robolink.methods.method import DEGREES, MM, AnyMethod, Help, InputNumber, Option, Site
from robolink.methods.pivot import axes_of, require_known_tip, require_tilting
from robolink.methods.shared_parameters import PinParameters, Retake
from robolink.methods.surface_touch.survey import SurveyT
from robolink.model import Pose, ToolOffset
from robolink.procedures import TAKE_ALL, SamplingPolicy, TouchPlan, TouchSource
from robolink.procedures.samples import ResultT
from robolink.runner import Procedure, TouchedAt

if TYPE_CHECKING:
    from robolink.methods.surface_touch.drive import SurfaceKind


@dataclass(frozen=True, kw_only=True)
class SurfaceParameters(PinParameters):
    """How a tip is lifted off a surface and returned; the surface stands for the pin."""

    lift_mm: Annotated[
        float,
        Ge(1),
        Le(100),
        MM,
        Help(declared("How far the tip is lifted before it tilts and turns.")),
    ] = 12.0
    clearance_mm: Annotated[
        float,
        Ge(0.5),
        Le(50),
        MM,
        Help(
            declared(
                "Least distance from the surface at which the robot stops; a person jogs the rest."
            )
        ),
    ] = 2.0
    contact_input: Annotated[
        InputNumber | None,
        Option(metavar="N"),
        Help(
            declared("Number of the input that shows contact of tip and surface, if there is one.")
        ),
    ] = None
    tilt_deg: Annotated[
        float,
        Ge(10),
        Le(45),
        DEGREES,
        Option(metavar="DEG"),
        Help(declared("How far the tool leans, relative to the first touch.")),
    ] = 30.0

    retake: Retake = False

    @property
    def sampling(self) -> SamplingPolicy:
        """Whether a person is offered to repeat a touch."""
        return SamplingPolicy(retake=self.retake)

    def states_station(self) -> bool:
        """Return that nothing need be known about the surface: it is found with the tip."""
        return True


def told_at(method: AnyMethod, parameters: SurfaceParameters, site: Site) -> dict[str, Any]:
    """Return what the site says to a source of surface touches.

    Raises:
        CalibrationError: ``rank_deficient``: the robot cannot tilt its tool.
    """
    require_tilting(site.controller, method.name)
    return {
        "axes": axes_of(site.controller),
        "sigma_mm": site.sigma_mm,
        "sampling": parameters.sampling,
    }


@dataclass(frozen=True, slots=True)
class SurfaceTouchSource(TouchSource, Generic[SurveyT, ResultT]):
    """Measures by touching one surface with the tool upright and tilted.

    Attributes:
        touch: Lift, clearance, contact input.
        survey: How many touches, and where.
        axes: How many axes the robot has, 0 where nobody knows.
        sigma_mm: Standard deviation of one touch along the normal, where it is known.
        sampling: Whether a touch is offered again when all are made.
    """

    touch: TouchPlan
    survey: SurveyT
    axes: int = 0
    sigma_mm: float | None = None
    sampling: SamplingPolicy = TAKE_ALL

    def foreseen(self) -> Self:
        """Return the source for a preview of its steps."""
        return replace(TouchSource.foreseen(self), sampling=TAKE_ALL)

    def steps(self, stored: ToolOffset | None) -> Procedure[ResultT]:
        """Return the steps; they end lifted, over the place touched last, as upright as they began.

        Raises:
            ConfigError: Nobody knows about where the tip is, so it cannot be kept off the surface.
        """
        from robolink.methods.surface_touch.drive import measure_surface  # numpy

        return (yield from measure_surface(self, self._kind(), require_known_tip(stored)))

    @property
    def can_add_touch(self) -> bool:
        """Where one more tells most depends on those of the plan."""
        return False

    def further_steps(
        self, here: Pose, taken: Sequence[TouchedAt], again: int | None, stored: ToolOffset | None
    ) -> Procedure[ResultT]:
        """Return the steps that repeat one touch."""
        from robolink.methods.surface_touch.drive import retake_on_surface  # numpy

        return (
            yield from retake_on_surface(
                self,
                self._kind(),
                require_known_tip(stored),
                here=here,
                taken=taken,
                again=len(taken) - 1 if again is None else again,
            )
        )

    @abstractmethod
    def _kind(self) -> "SurfaceKind[SurveyT, ResultT]":
        """Return what the surface is."""
