"""Whether a controller can do what a recipe asks for, and may: by its kind and its numbers."""

from dataclasses import replace
from typing import TYPE_CHECKING

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.methods import PointsParameters
from robolink.methods.pivot import LEAST_AXES
from robolink.model import Capabilities, Controller, LookingController, says_it_is_simulated
from robolink.sensing import VISION_GUIDE

if TYPE_CHECKING:
    from robolink.recipe._loading import LoadedRecipe
    from robolink.recipe.file.recipe import Recipe


def beyond(
    recipe: "Recipe",
    able: Capabilities,
    *,
    other_sensor: bool = False,
    writes: bool = True,
    axes: int | None = None,
) -> tuple[str, ...]:
    """Return what a recipe asks for and a controller cannot do, a sentence each.

    Args:
        recipe: The recipe.
        able: What the controller, or its kind, can be asked for.
        other_sensor: Whether another camera takes the place of the recipe's.
        writes: Whether the tools are written.
        axes: How many axes the robot has; ``None`` where nobody knows yet.

    Example:
        >>> from pathlib import Path
        >>> from robolink.controllers import capabilities_of_kind
        >>> from robolink.recipe import beyond, load_recipe
        >>> from robolink_simulators.testkit.operator import written_recipe
        >>> recipe = load_recipe(written_recipe(Path.cwd())).recipe
        >>> beyond(recipe, capabilities_of_kind("plc"))
        ('The recipe moves the robot, which this controller cannot be told to.',)
        >>> beyond(recipe, capabilities_of_kind("epson"))
        ()
    """
    parameters = recipe.source.parameters
    taught = isinstance(parameters, PointsParameters) and any(one.points for one in recipe.tools)
    camera = "" if other_sensor else str(getattr(parameters, "sensor", None) or "")
    looks = camera.partition("?")[0] == VISION_GUIDE
    found = []
    if recipe.source.of_method.needs.motion and not able.motion:
        found.append(tr("The recipe moves the robot, which this controller cannot be told to."))
    if recipe.source.of_method.needs.tilt and axes is not None and axes < LEAST_AXES:
        found.append(
            tr("The recipe tilts the tool, which a robot of {axes} axes cannot do.", axes=axes)
        )
    if taught and not able.points:
        found.append(tr("The recipe reads taught points, and this controller has none."))
    if looks and not able.looks:
        found.append(
            tr("The recipe looks with Vision Guide, and this controller has no vision system.")
        )
    if recipe.outputs and (able.inputs_only or not able.io):
        found.append(tr("The recipe switches outputs, and this controller has none."))
    if writes and not able.tool_write:
        found.append(tr("The recipe writes tools, and this controller lets nobody write any."))
    return tuple(found)


def require_able(
    controller: Controller, recipe: "Recipe", *, other_sensor: bool, writes: bool
) -> None:
    """Refuse a recipe that asks for what a controller cannot do; asks it nothing.

    Args:
        controller: The controller, connected.
        recipe: The recipe.
        other_sensor: Whether another camera takes the place of the recipe's.
        writes: Whether the tools are written.

    Raises:
        ConfigError: Says what it cannot do.
    """
    able = controller.capabilities
    if isinstance(controller, LookingController):
        able = replace(able, looks=True)
    found = beyond(recipe, able, other_sensor=other_sensor, writes=writes)
    if found:
        raise ConfigError(
            " ".join(found),
            remedy=tr("Choose a recipe for this kind of controller. Nothing was moved or written."),
            controller=controller.identity,
        )


def require_own_numbers(controller: Controller, loaded: "LoadedRecipe") -> None:
    """Refuse a copy that nobody has put the numbers of the cell in, where something moves; reads.

    Args:
        controller: The controller, connected.
        loaded: The recipe.

    Raises:
        ConfigError: Its numbers are those of a simulated cell, and the controller is a real one.
    """
    if loaded.recipe.numbers is None or says_it_is_simulated(controller):
        return
    raise ConfigError(
        tr("The numbers of {path} are those of a simulated cell.", path=loaded.path),
        remedy=tr(
            "Put in stations, poses, box and limits of this cell, then delete the line "
            "'numbers'. Nothing was moved or written."
        ),
        controller=controller.identity,
    )
