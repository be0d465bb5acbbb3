"""The meaning of the answers: a tool table, an arm that can be polled, and their controller."""

from collections.abc import Sequence

from robolink.controllers import (
    ConnectionTerms,
    ControllerCore,
    PolledGroup,
    ToolTableCore,
    ToolWrite,
)
from robolink.model import (
    Capabilities,
    Controller,
    ControllerStatus,
    Expected,
    MotionProfile,
    Pose,
    ToolOffset,
    ToolReceipt,
    ToolTable,
)
from robolink.stop_latch import CommandClass
from robolink.transport import LinkUrl, open_transport
from tests.contract.third_kind.bench_link import BenchLink


def open_bench(url: LinkUrl, terms: ConnectionTerms, /) -> Controller:
    """Connect; the entry point of the package names this function."""
    transport = open_transport(url, timeout_s=terms.timeout_s, clock=terms.clock)
    outcomes = terms.record_of(transport)
    return BenchController(BenchLink(transport, outcomes, timeout_s=terms.timeout_s))


class BenchController(ControllerCore):
    """The controller: 4 members; all kinds share the rest."""

    def __init__(self, link: BenchLink) -> None:
        self._link = link
        able = Capabilities(tool_write=True, motion=True)
        super().__init__(link, capabilities=able, tools=BenchTools(link))
        self.groups = (BenchArm(link, self.tools),)

    @property
    def exchanges(self) -> int:
        return self._link.exchanges

    def _read_status(self) -> ControllerStatus:
        self._link.ask("STATUS")
        return ControllerStatus(remote=True, ready=True)

    def _close_link(self) -> None:
        self._link.close()


class BenchTools(ToolTableCore):
    """Tools 1 to 8."""

    def __init__(self, link: BenchLink) -> None:
        super().__init__(link)
        self._link = link

    def indices(self) -> Sequence[int]:
        return range(1, 9)

    def same(self, a: ToolOffset | None, b: ToolOffset | None) -> bool:
        return a is b if a is None or b is None else a.matches(b, 5e-7)

    def _storable(self, tool: int, offset: ToolOffset) -> ToolOffset:
        return offset.rounded(6)

    def _set(self, tool: int, requested: ToolOffset | None, expected: Expected) -> ToolReceipt:
        request = self._request(tool, requested)
        return BenchWrite(self._link, tool, requested, request, same=self.same).change(expected)

    def _request(self, tool: int, requested: ToolOffset | None) -> str:
        if requested is None:
            return f"DROP {tool}"
        return " ".join(("SET", str(tool), *map(str, requested.components())))

    def _stored(self, tool: int) -> ToolOffset | None:
        numbers = self._link.ask(f"TOOL {tool}")
        return ToolOffset(*numbers) if numbers else None

    def _selected(self) -> int:
        return int(*self._link.ask("USED"))

    def _select_request(self, tool: int) -> str:
        return f"USE {tool}"

    def _send_selection(self, tool: int) -> None:
        self._link.ask(self._select_request(tool), CommandClass.RESTORE)


class BenchWrite(ToolWrite):
    """One write of a tool."""

    _link: BenchLink

    def read_before(self, expected: Expected) -> ToolOffset | None:
        return self.read_back()

    def send(self) -> None:
        self._link.ask(self.request, CommandClass.WRITE)

    def read_back(self) -> ToolOffset | None:
        numbers = self._link.ask(f"TOOL {self.tool}")
        return ToolOffset(*numbers) if numbers else None


class BenchArm(PolledGroup):
    """The arm."""

    def __init__(self, link: BenchLink, tools: ToolTable) -> None:
        super().__init__(link, tools)
        self._link = link

    @property
    def name(self) -> str:
        return "arm"

    def pose(self) -> Pose:
        tool = int(*self._link.ask("USED"))
        x_mm, y_mm, z_mm, u_deg = self._link.ask("POSE")
        return Pose(x_mm, y_mm, z_mm, u_deg, tool=tool)

    def requests_for(self, target: Pose, profile: MotionProfile) -> tuple[str, ...]:
        return (" ".join(("GO", *map(str, target.coordinates()[:4]))),)

    def moving(self) -> bool:
        return bool(*self._link.ask("MOVING"))

    def _send_move(self, target: Pose, profile: MotionProfile) -> None:
        (request,) = self.requests_for(target, profile)
        self._link.ask(request, CommandClass.ACT)

    def _send_stop(self) -> None:
        self._link.ask("HALT", CommandClass.CALM)
