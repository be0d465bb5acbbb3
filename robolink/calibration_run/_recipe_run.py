"""One run of a recipe: preflight, then the nozzle change with what the recipe adds."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

from robolink.calibration_run._forecast import Forecast, RunForecaster, work_digest
from robolink.calibration_run._nozzle_change import DescribeReport, NozzleChange
from robolink.calibration_run._plan import ChangePlan, Proposals, require_ready
from robolink.calibration_run._preview import (
    PlannedStep,
    preview,
    rehearse,
    require_inside,
    require_proofs,
    require_turn_test,
)
from robolink.calibration_run._proposal import ChangeReport, Listener
from robolink.calibration_run._recipe_listener import RecipeListener
from robolink.calibration_run._recipe_plan import Reference, find_reference, located, plan_of
from robolink.config import Cell
from robolink.controllers import JointRates
from robolink.errors import ConfigError, NotAllowedError, RobolinkError
from robolink.messages import listed, tr
from robolink.model import (
    AnsweredBy,
    Controller,
    LookingController,
    PersonRole,
    TipSensor,
    ToolOffset,
    says_it_is_simulated,
)
from robolink.procedures import MeasurementContext
from robolink.recipe import Answers, beyond
from robolink.remedy_words import RemedyWord, remedy_word
from robolink.runner import Operator, Rehearsal, RobotTime
from robolink.stations import Station, find_stations, require_base_of, stations_on_record
from robolink.transaction import ChangedSince, Order, changed_since, earlier_corrections

if TYPE_CHECKING:
    from robolink.recipe import LoadedRecipe, Recipe


class RecipeRun:
    """One run of a recipe on one controller.

    Attributes:
        plan: What will be done.
        takes_reference: Whether the run only records a reference and writes nothing; known
            after :meth:`preflight`.
        changed: Tools that somebody else changed since they were last written from here; known
            after :meth:`preflight`.
        forecast: How long the robot will take; known after :meth:`preflight`, ``None`` where
            nothing moves.
        robot_s: How long it took, in s; known after :meth:`run`.

    Args:
        controller: The controller, connected.
        loaded: The recipe.
        operator: Who is asked, and brings the tip onto the pin.
        answers: What was answered in advance; nothing by default.
        audience: Told of everything that happens; nobody by default.
        take_reference: Whether to take a new reference in any case.
        accepted_change_mm: A larger jump than the recipe's that an engineer accepts this time.
        ask_before_write: Whether a person accepts the proposals.
        sensor: The camera in place of the recipe's: an open one, which is left open, or its name
            or URL.
        cell: The cell, whose file may say where stations are.
        measure_only: Whether nothing is written, kept or asked about lengths; only for methods
            that measure by a sensor.
        order: The order that it carries out (:func:`robolink.transaction.carrying_out`); one that
            only takes a reference carries out none.
        describe: Makes the result of the order, plain JSON, from what the change did.

    Raises:
        CalibrationError: ``rank_deficient``: this robot cannot tilt its tool, and would have to.
        ConfigError: The recipe is for another cell, or asks for what this kind of controller
            cannot do, neither it nor the station's record says
            where the station is, it takes no reference, or a person would have to touch where
            only is measured.

    Example:
        >>> from pathlib import Path
        >>> import robolink
        >>> from robolink.calibration_run import RecipeRun
        >>> from robolink.recipe import load_recipe
        >>> from robolink_simulators.testkit.operator import written_recipe
        >>> with robolink.connect("epson+sim://recipe-example") as controller:
        ...     loaded = load_recipe(written_recipe(Path.cwd()))
        ...     run = RecipeRun(controller, loaded, operator=None)
        ...     [one.tool for one in run.plan.tools]
        [1]
    """

    def __init__(
        self,
        controller: Controller,
        loaded: "LoadedRecipe",
        *,
        operator: Operator,
        answers: Answers | None = None,
        audience: Listener | None = None,
        take_reference: bool = False,
        accepted_change_mm: float | None = None,
        ask_before_write: bool = True,
        sensor: str | TipSensor | None = None,
        cell: Cell | None = None,
        measure_only: bool = False,
        order: Order | None = None,
        describe: DescribeReport | None = None,
    ) -> None:
        _require_cell(loaded, cell)
        if measure_only:
            _require_sensor(loaded)
        _require_able(
            controller, loaded.recipe, other_sensor=sensor is not None, writes=not measure_only
        )
        self._controller = controller
        self._measure_only = measure_only
        self._order, self._describe = order, describe
        self._loaded, station, known = _located(loaded, controller, cell)
        self._remark = known.remark() if known else ""
        self._rests_on = _rests_on(self._loaded, station, known)
        self._operator = operator
        self._answers = answers or Answers()
        self._audience = audience or Listener()
        self._references: dict[int, Reference] = {}
        self.plan: ChangePlan = plan_of(
            self._loaded.recipe,
            station,
            controller,
            folder=loaded.path.parent,
            ask_before_write=ask_before_write,
            agreed_by=AnsweredBy.YES if self._answers.yes else AnsweredBy.PROGRAM,
            accepted_change_mm=accepted_change_mm,
            sensor=sensor,
            stated=find_stations(cell, ()).get(loaded.recipe.station.id),
            cell=cell,
        )
        if take_reference and not loaded.recipe.source.of_method.by_reference:
            raise ConfigError(
                tr("This recipe needs no reference: it uses the last calibration on the pin."),
                remedy=tr("Run a full calibration there with the previous nozzle."),
            )
        self.takes_reference = take_reference
        self.changed: tuple[ChangedSince, ...] = ()
        self.forecast: Forecast | None = None
        self.robot_s: float | None = None
        self._of_file = loaded.recipe
        self._rates = _rates(cell)
        self._before_write: Callable[[MeasurementContext, Proposals], None] | None = None
        self._other_sensor = sensor if isinstance(sensor, str) else "" if sensor is None else "own"
        self._ahead: RunForecaster | None = None

    def preflight(self) -> None:
        """Check, by reading only, everything that would end the run later.

        Raises:
            CalibrationError: ``reference_outdated``, ``no_last_touch`` or ``sensor_not_found``.
            ConfigError: The recipe's numbers are those of a simulated cell, and this is none.
            ConnectError: A camera is not there.
            LimitError: A foreseen target lies outside the box, or the arm cannot turn the tool for
                the turn test.
            NotReadyError: The station was learnt in another base.
            NotAllowedError: A jump is accepted by somebody who is no engineer.
            OutcomeUnknownError: An earlier job is unfinished.
            BusyError: Somebody else is changing this controller.
            RobolinkError: The controller's state forbids it.
        """
        controller, recipe = self._controller, self._loaded.recipe
        _require_own_numbers(controller, self._loaded)
        controller.outcomes.look()
        controller.require_settled(tr("recipe {name!r}", name=recipe.name))
        self._require_role()
        require_base_of(controller, self._rests_on)
        stored = {tool.number: controller.tools.read(tool.number) for tool in recipe.tools}
        found = (changed_since(controller, tool, now) for tool, now in stored.items())
        self.changed = tuple(change for change in found if change is not None)
        if self._remark:
            self._operator.tell(tr("Warning: {remark}", remark=self._remark))
        by_reference = recipe.source.of_method.by_reference
        if recipe.basis == "difference" and by_reference and not self.takes_reference:
            for tool in stored:
                reference = find_reference(controller, tool, recipe.station.id)
                if reference is not None:
                    self._references[tool] = reference
            # If one tool has no reference, all of them wait: all are written, or none.
            self.takes_reference = len(self._references) < len(stored)
        if self.takes_reference and self._measure_only:
            raise ConfigError(
                tr("This recipe has no reference yet: there is nothing to compare with."),
                remedy=tr("Run it once with 'robolink change', which records it."),
            )
        if self._order is not None and (self.takes_reference or self._measure_only):
            raise ConfigError(
                tr("This run writes no tool, but an order must be a change."),
                remedy=tr("Record the reference first, in a run without an order."),
            )
        require_ready(controller, self.plan)
        steps = preview(controller, self.plan)
        require_inside(controller, steps)
        mode = "check" if self._measure_only else "change"
        mode = "reference" if self.takes_reference else mode
        version = controller.outcomes.signature.version
        self._ahead = RunForecaster(
            controller,
            self._loaded.name,
            f"{mode} {self._other_sensor}".strip(),
            work_digest(self._of_file, self.plan, version=version),
            self.plan,
            steps,
            partial(self._rehearsed, stored, steps),
            self._rates,
        )
        self.forecast = self._ahead.forecast()

    def _rehearsed(
        self, stored: Mapping[int, ToolOffset | None], steps: Sequence[PlannedStep]
    ) -> Rehearsal | None:
        """Go through the run as it will be if the tips are where they are expected.

        Raises:
            LimitError: The turn test cannot be made, whatever is measured.
        """
        here = next((one.start for one in steps if one.start is not None), None)
        if here is None:
            return None
        writes = not (self.takes_reference or self._measure_only)
        gone = rehearse(self._controller, self.plan, here=here, stored=stored, writes=writes)
        if gone is not None and writes:
            require_turn_test(self._controller, self.plan, gone)
            # No run like this one has shown it: asked once more, for the tips that are found.
            self._before_write = partial(require_proofs, self._controller, self.plan)
        return gone

    def ask_ids(self, ask: Callable[[str], str]) -> Iterator[str]:
        """Ask for the ids of nozzles and lots before anything moves; yield each.

        Args:
            ask: Puts a question to the person and returns what was typed.
        """
        for number, prompt, tool in list(self._answers.ids_wanted(self._loaded.recipe)):
            named = len(self._loaded.recipe.tools) > 1 and tool is not None
            text = tr("Tool {tool}: {question}", tool=tool, question=prompt.text)
            answer = ask(text if named else prompt.text)
            early = {**self._answers.early, (number, tool): answer}
            self._answers = replace(self._answers, early=early)
            if prompt.answer == "nozzle":
                yield answer

    def run(self) -> ChangeReport:
        """Carry it out; :meth:`preflight` comes first unless it has passed.

        Raises:
            RobolinkError: As :meth:`preflight`, and as
                :meth:`robolink.calibration_run.NozzleChange.run`; outputs that the recipe switched
                stay as they are, and the error names them.
        """
        if self._ahead is None:
            self.preflight()
        time = RobotTime(self._controller, self.plan.start)
        with self._signed():
            listener = self._listener()
            with self._outputs_told(listener), time.counted():
                report = self._change(listener, time).run(
                    write=not (self.takes_reference or self._measure_only)
                )
            self.robot_s = time.seconds if self.plan.moves else None
            self._record(time, report)
        return report

    def _record(self, time: RobotTime, report: ChangeReport) -> None:
        """Record how long the robot took; what was done does not depend on it."""
        entry = self._ahead.entry(time, report.change) if self._ahead else None
        if entry is not None:
            with suppress(ConfigError, RobolinkError):
                self._controller.outcomes.append(entry)

    def _listener(self) -> RecipeListener:
        """Return the listener for the recipe's part; it signs as the run does now."""
        return RecipeListener(
            self._loaded.recipe,
            self._controller,
            self._answers,
            references={} if self.takes_reference else self._references,
            taking_reference=self.takes_reference,
            measure_only=self._measure_only,
            stated_pin=self.plan.tools[0].stated_pin,
            audience=self._audience,
        )

    def _change(self, listener: RecipeListener, time: RobotTime) -> NozzleChange:
        return NozzleChange(
            self._controller,
            self.plan,
            operator=self._operator,
            listener=listener,
            earlier=partial(earlier_corrections, self._controller),
            order=self._order,
            describe=self._describe,
            robot_time=time,
            before_write=self._before_write,
        )

    @contextmanager
    def _signed(self) -> Iterator[None]:
        """Let every entry name the recipe, the station, the nozzle and its lot."""
        outcomes, loaded = self._controller.outcomes, self._loaded
        before = outcomes.signature
        outcomes.signature = replace(
            before,
            recipe=loaded.name,
            recipe_hash=loaded.sha256,
            station=loaded.recipe.station.id,
            nozzle=self._answers.nozzle,
            lot=self._answers.lot,
        )
        try:
            yield
        finally:
            outcomes.signature = before

    @contextmanager
    def _outputs_told(self, listener: RecipeListener) -> Iterator[None]:
        """Report how the outputs were left, whatever ends the run early."""
        try:
            yield
        except RobolinkError as error:
            error.say_what_stands(self._outputs_left(listener))
            raise
        except KeyboardInterrupt:
            if said := self._outputs_left(listener):
                self._operator.tell(said)
            raise

    def _outputs_left(self, listener: RecipeListener) -> str:
        """Report how the outputs were left.

        An emergency stop may switch them off by itself (docs/reference/spel.md 8): what the recipe
        had switched is not how they are then. Where the controller cannot be asked any more, only
        what the recipe did is known.
        """
        stopped = False
        with suppress(RobolinkError):
            stopped = self._controller.status().emergency_stop
        return _switched(listener, stopped=stopped)

    def _require_role(self) -> None:
        if not any(plan.criteria.accepted_change_mm for plan in self.plan.tools):
            return
        signature = self._controller.outcomes.signature
        if signature.role == PersonRole.OPERATOR:
            raise NotAllowedError(
                tr("A change this large needs an engineer."),
                remedy=tr(
                    "Nothing moved. Give {operator}, or leave out {accept_jump}.",
                    operator=remedy_word(RemedyWord.OPERATOR),
                    accept_jump=remedy_word(RemedyWord.ACCEPT_JUMP),
                ),
            )


def _rates(cell: Cell | None) -> JointRates | None:
    """Return how fast the joints are, where the cell file says it."""
    if cell is None or cell.settings.joint_speeds is None:
        return None
    return JointRates(cell.settings.joint_speeds, cell.settings.joint_accelerations or ())


def _require_cell(loaded: "LoadedRecipe", cell: Cell | None) -> None:
    name, cells = cell.name if cell else "", ", ".join(loaded.recipe.cells)
    if loaded.recipe.is_for(name):
        return
    raise ConfigError(
        tr(
            "The recipe {recipe!r} is for {cells}, not for {cell}.",
            recipe=loaded.name,
            cells=cells,
            cell=name,
        )
        if name
        else tr(
            "The recipe {recipe!r} is for {cells}; no cell is named here.",
            recipe=loaded.name,
            cells=cells,
        ),
        remedy=tr(
            "Nothing was sent. Choose a recipe of this cell, or name the cell; 'cells' in "
            "the recipe lists its cells."
        ),
    )


def _require_sensor(loaded: "LoadedRecipe") -> None:
    """Refuse a recipe by which a person would touch something.

    Raises:
        ConfigError: It is one.
    """
    method = loaded.recipe.source.of_method
    if not method.needs.by_sensor:
        raise ConfigError(
            tr(
                "The method {method!r} needs a person to touch; a check measures by "
                "beams, a switch or a camera.",
                method=method.name,
            ),
            remedy=tr("Name a recipe that measures by a sensor."),
        )


def _switched(listener: RecipeListener, *, stopped: bool) -> str:
    """Report which outputs the recipe left switched, and what an emergency stop did to them."""
    if not listener.switched:
        return tr("The emergency stop may have switched outputs off.") if stopped else ""
    states = ", ".join(
        f"{number} {tr('on') if on else tr('off')}" for number, on in listener.switched.items()
    )
    if stopped:
        return tr(
            "The emergency stop may have switched outputs off; the recipe had switched: {states}.",
            states=states,
        )
    return tr("Outputs stay as the recipe switched them: {states}.", states=states)


def _located(
    loaded: "LoadedRecipe", controller: Controller, cell: Cell | None
) -> tuple["LoadedRecipe", Station, Station | None]:
    """Return the recipe with its station's place, the station, and what is known of that."""
    stations = stations_on_record(controller, cell)
    recipe, station = located(loaded.recipe, stations)
    return replace(loaded, recipe=recipe), station, stations.get(loaded.recipe.station.id)


def _rests_on(loaded: "LoadedRecipe", station: Station, known: Station | None) -> Station:
    """Return the station that the run relies on: the known one unless the recipe states it.

    A full calibration finds the pin anew, and is judged by where it was.
    """
    says_it = not station.learnt and loaded.recipe.source.of_method.needs.place is not None
    return station if known is None or says_it else known


def _require_able(
    controller: Controller, recipe: "Recipe", *, other_sensor: bool, writes: bool
) -> None:
    """Refuse a recipe that a controller cannot carry out; asks it nothing.

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
            listed(tr("This controller lacks what the recipe needs:"), found),
            remedy=tr("Nothing was moved or written. Choose a recipe for this kind of controller."),
            controller=controller.identity,
        )


def _require_own_numbers(controller: Controller, loaded: "LoadedRecipe") -> None:
    """Refuse a copy without the cell's own numbers, if something moves; reads.

    Args:
        controller: The controller, connected.
        loaded: The recipe.

    Raises:
        ConfigError: Its numbers are those of a simulated cell, and the controller is a real one.
    """
    if loaded.recipe.numbers is None or says_it_is_simulated(controller):
        return
    raise ConfigError(
        tr("The numbers in {path} are for a simulated cell.", path=loaded.path),
        remedy=tr("Nothing moved. Enter this cell's numbers, then delete the line 'numbers'."),
        controller=controller.identity,
    )
