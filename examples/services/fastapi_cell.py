"""A web service for one cell: read tools, write them, stop.

    pip install robolink fastapi uvicorn
    ROBOLINK_CONTROLLER=epson+tcp://192.168.0.1:5000 uvicorn --factory fastapi_cell:service

One controller for the whole service: an EPSON controller lets one client in, and only one object
can keep two writes apart without a second login. Run one worker process.
"""

import asyncio
import os
from collections.abc import AsyncGenerator
from concurrent.futures import ThreadPoolExecutor
from contextlib import asynccontextmanager

from fastapi import FastAPI, Request
from fastapi.responses import JSONResponse
from pydantic import BaseModel

import robolink
from robolink import RobolinkError, ToolOffset
from robolink.errors import BusyError, ControllerError, StoppedError, ToolError


class Write(BaseModel):
    """What a tool is to hold, and what it is believed to hold; ``null`` is an undefined tool."""

    offset: ToolOffset
    expected: ToolOffset | None


def service(url: str | None = None) -> FastAPI:
    """Return the service; it connects when it starts, and logs out when it ends."""
    stops = ThreadPoolExecutor(1, thread_name_prefix="stop")

    @asynccontextmanager
    async def connected(app: FastAPI) -> AsyncGenerator[None, None]:
        address = url or os.environ["ROBOLINK_CONTROLLER"]
        # A write waits 5 s for the writes before it, and only then gets BusyError.
        with robolink.connect(address, wait_s=5.0) as controller:
            app.state.controller = controller
            yield

    app = FastAPI(title="Tool offsets of one cell", lifespan=connected)

    # ``def``, not ``async def``: FastAPI then calls it in a thread, and may be blocked there.
    @app.get("/tools/{tool}")
    def read(request: Request, tool: int) -> ToolOffset | None:
        controller: robolink.Controller = request.app.state.controller
        return controller.tools.read(tool)

    @app.put("/tools/{tool}")
    def write(request: Request, tool: int, body: Write) -> ToolOffset | None:
        controller: robolink.Controller = request.app.state.controller
        return controller.tools.write(tool, body.offset, expected=body.expected).read_back

    @app.post("/stop")
    async def stop(request: Request) -> str:
        # A thread of its own: all of FastAPI's may be waiting for their turn.
        controller: robolink.Controller = request.app.state.controller
        await asyncio.get_running_loop().run_in_executor(stops, controller.stop)
        return "stopped"

    @app.post("/release")
    def release(request: Request) -> str:
        """Let writes pass again after a stop: for a person who sees the cell."""
        controller: robolink.Controller = request.app.state.controller
        controller.release_stop()
        return "released"

    @app.exception_handler(RobolinkError)
    async def refused(_request: Request, error: RobolinkError) -> JSONResponse:
        said = {"error": error.what, "remedy": error.remedy, "kind": type(error).__name__}
        if isinstance(error, BusyError):
            return JSONResponse(said, status_code=503, headers={"Retry-After": "1"})
        conflict = isinstance(error, (ControllerError, StoppedError, ToolError))
        # 502: look at the robot, OutcomeUnknownError among them; a client must not repeat it.
        return JSONResponse(said, status_code=409 if conflict else 502)

    return app
