"""One kind of simulator: how the options of its command make and serve it."""

import json
from collections.abc import Callable, Collection, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from robolink_simulators.cell.clock import EXCHANGE_S, SteeredClock
from robolink_simulators.control.cell import AnySimulator, ControlledCell
from robolink_simulators.faults import LinkKind, fault_as_keys, read_fault_file
from robolink_simulators.hosting.garbage import RareFullCollections
from robolink_simulators.plc import PlcSimulator

from robolink.messages import tr
from robolink.timing import NS_PER_S
from robolink_cli.commands.simulate.service import (
    Termination,
    announce,
    controlled,
    host_and_port,
)
from robolink_cli.console.output import hand_over, show
from robolink_cli.console.render import json_is_on
from robolink_cli.options.simulation import ServedLife

if TYPE_CHECKING:
    from robolink_simulators.control.assist import AssistHost
    from robolink_simulators.pictures.gige_camera import GigeCamera
    from robolink_simulators.pictures.server import PictureServer


Options = Mapping[str, Any]
"""Values of a command's options by parameter name."""


@dataclass(frozen=True, slots=True)
class ServedPictures:
    """Where pictures of a cell's camera are served; nowhere where neither is.

    Attributes:
        server: Over HTTP.
        gige: As a GigE camera.
    """

    server: "PictureServer | None" = None
    gige: "GigeCamera | None" = None

    @property
    def requests(self) -> int:
        """How many pictures were asked for."""
        asked = 0 if self.server is None else self.server.requests
        return asked if self.gige is None else asked + self.gige.frames

    @property
    def told(self) -> list[str]:
        """One URL of each."""
        by_http = [] if self.server is None else [self.server.url()]
        return by_http if self.gige is None else [*by_http, self.gige.url]

    def document(self) -> dict[str, object]:
        """Return what a script is told, under ``camera``; nothing where there is nothing."""
        if self.gige is None:
            return {} if self.server is None else {"camera": self.server.document()}
        gige = self.gige.document()
        if self.server is None:
            return {"camera": gige}
        by_http = self.server.document()
        urls = {**cast("dict[str, str]", by_http["urls"]), "gige": self.gige.url}
        return {"camera": {**by_http, "urls": urls}}


@dataclass(frozen=True, slots=True)
class ServedCell:
    """A simulator on its ports.

    Attributes:
        controlled: It, its time, and where clients connect to.
        assist: Where robolink asks the person beside it; ``None`` where nobody stands there.
        about: What else the first line says of it.
        pictures: Where those of its camera are served.
    """

    controlled: ControlledCell
    assist: "AssistHost | None"
    about: Mapping[str, object]
    pictures: "ServedPictures"

    @property
    def requests(self) -> int:
        """Traffic to and from its ports since it was made or reset."""
        asked = 0 if self.assist is None else self.assist.requests
        return self.controlled.simulator.log.added + asked + self.pictures.requests

    def document(self, control: str) -> dict[str, object]:
        """Return what a script is told of it: URLs, kind, machine and seed."""
        simulator, urls = self.controlled.simulator, dict(self.controlled.urls)
        person = {} if self.assist is None else {"assist": self.assist.url}
        seen = self.pictures.document()
        first = next(iter(urls.values()))
        where = {"url": first, "urls": urls, **person, **seen, "control": control}
        return {**where, "kind": simulator.kind, **self.about, "seed": simulator.seed}


@dataclass(frozen=True, slots=True)
class SimulatedKind:
    """How the simulators of one command are made and served.

    Attributes:
        make: Makes one from them; no port is opened yet.
        place: Serves it by them, and returns its URLs by link.
        about: Returns what its first line says beside URLs and seed.
        title: Returns the sentence that names it.
        person: Whether a person stands beside it.
    """

    make: Callable[..., AnySimulator]
    place: Callable[..., dict[str, str]]
    about: Callable[[Any], Mapping[str, object]]
    title: Callable[[Any], str]
    person: bool = True

    def serve(
        self, stack: ExitStack, simulator: AnySimulator, given: Options, *, person: bool
    ) -> ServedCell:
        """Serve one until a stack is closed.

        Args:
            stack: Closes its ports.
            simulator: What was made of these options.
            given: The options.
            person: Whether somebody stands beside it, where that is possible.

        Raises:
            ConfigError: An address is none, or other machines could reach it and may not.
            ConnectError: A port is taken.
        """
        speed, exchange_s = given["speed"], given["exchange"]
        if exchange_s is None:  # at speed 0 only exchanges let time pass
            exchange_s = 0.0 if speed else EXCHANGE_S
        clock = SteeredClock(speed, exchange_s=exchange_s)
        urls = self.place(stack, simulator, clock, **given)
        assist = None
        if person and not isinstance(simulator, PlcSimulator):
            from robolink_simulators.control.assist import serve_assist

            assist = stack.enter_context(serve_assist(simulator, clock=clock))
        return ServedCell(
            ControlledCell(simulator, clock, urls),
            assist,
            self.about(simulator),
            _pictures(stack, simulator, given),
        )


def _pictures(stack: ExitStack, simulator: AnySimulator, given: Options) -> "ServedPictures":
    """Serve the pictures of its camera in each way that is asked for.

    Raises:
        ConfigError: The address is none, or other machines could reach it and may not; or the
            library of GigE cameras is missing.
        ConnectError: The port is taken.
    """
    ways = [given.get(way) for way in ("camera", "camera_folder", "camera_gige")]
    if isinstance(simulator, PlcSimulator) or ways == [None, None, None]:
        return ServedPictures()
    address, folder, gige = ways
    # Only now: drawing takes numpy, which the others do without.
    from robolink_simulators.pictures.camera import DrawnCamera

    camera = DrawnCamera(simulator)
    if folder is not None:
        from robolink_simulators.pictures.folder import PictureFolder

        stack.enter_context(PictureFolder(camera, folder))
    server = gige_camera = None
    if address is not None:
        from robolink_simulators.pictures.server import PictureServer

        place = host_and_port(address, "--camera")
        server = PictureServer(camera, place, allow_remote=given["allow_remote"])
        stack.enter_context(server)
    if gige is not None:
        from robolink_simulators.pictures.gige_camera import drawn_gige_camera

        gige_camera = stack.enter_context(drawn_gige_camera(camera, gige))
    return ServedPictures(server, gige_camera)


def serve_alone(kind: SimulatedKind, life: ServedLife, given: Options) -> None:
    """Make one simulator and serve it, with its control API, until SIGTERM or Ctrl-C.

    Args:
        kind: Of which kind.
        life: Where it is controlled, and when it ends by itself.
        given: The options of its command.

    Raises:
        ConfigError: Something that was given makes no sense.
        ConnectError: A port is taken.
    """
    simulator = kind.make(**given)
    with ExitStack() as stack:
        stopped = stack.enter_context(Termination(life))
        stack.enter_context(RareFullCollections())
        served = kind.serve(stack, simulator, given, person=True)
        cells = {"cell": served.controlled}
        control = stack.enter_context(controlled(cells, life, allow_remote=given["allow_remote"]))
        document = served.document(control.url_of("cell"))
        announce(document, [kind.title(simulator), *_told(served, document)], stopped.state_dir)
        stopped.wait(lambda: served.requests + control.requests, lambda: simulator.failure)


def _told(served: ServedCell, document: Mapping[str, object]) -> list[str]:
    lines = [f"  {link.ljust(10)}  {url}" for link, url in served.controlled.urls.items()]
    if served.assist is not None:
        lines.append(tr("  assist      {url}", url=served.assist.url))
    for url in served.pictures.told:
        lines.append(tr("  camera      {url}", url=url))
    lines.append(tr("  control     {url}", url=document["control"]))
    if served.controlled.simulator.kind == "plc":
        lines.append(tr('Try: robolink -c "{url}" expert plc check-map', url=document["url"]))
    else:
        lines.append(tr('Try: robolink -c "{url}" status', url=document["url"]))
    if served.assist is not None:
        lines.append(tr("To see how far the tip is from the pin: robolink sim assist ASSIST look"))
    return [*lines, tr("Ctrl-C ends it.")]


def plan_faults(
    simulator: Any,  # noqa: ANN401 - any simulator with faults
    file: Path | None,
    served: Collection[LinkKind],
    *,
    cell: str = "",
) -> None:
    """Plan the faults of a file; each fault that fires is then reported in a line on stdout.

    Args:
        simulator: For which.
        file: The file, if any.
        served: The links that it will be served on.
        cell: Its name among several, which is told with each fault.

    Raises:
        ConfigError: The file is wrong, or a fault cannot happen on any link that is served.
    """
    if file is None:
        return
    plan = read_fault_file(file)
    simulator.faults.plan(plan.faults, plan.seed, served)
    as_json = json_is_on()

    def tell(fault: Any, request: str) -> None:  # noqa: ANN401 - of any simulator
        keys = fault_as_keys(fault)
        if as_json:
            named = {"cell": cell} if cell else {}
            document = {"schema": "robolink/fault/1", **named, "fault": keys, "request": request}
            hand_over(json.dumps({**document, "simulated_s": simulator.now_ns / NS_PER_S}))
        else:
            told = tr("FAULT {action}: {request}", action=keys["action"], request=request)
            show(f"{cell}: {told}" if cell else told)

    simulator.faults.on_fired = tell
