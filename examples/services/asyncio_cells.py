"""Several cells in one asyncio program: calls run in threads, and a time-out stops the robot.

python examples/services/asyncio_cells.py epson+sim://cell-a softmotion+sim://cell-b
"""

import asyncio
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import robolink
from robolink import Controller, ToolOffset

STOPS = ThreadPoolExecutor(thread_name_prefix="stop")
"""Threads only for stops: those of ``asyncio.to_thread`` may all be waiting."""


def shift(controller: Controller, tool: int, dx_mm: float) -> ToolOffset:
    """Move a tool's offset along X: one procedure, so nobody writes between read and write."""
    with controller.procedure(f"shift of tool {tool}"):
        stored = controller.tools.read(tool)  # None where the tool is undefined
        before = stored or ToolOffset()
        after = replace(before, x_mm=before.x_mm + dx_mm)
        receipt = controller.tools.write(tool, after, expected=stored)
    return receipt.read_back or ToolOffset()


async def shift_within(
    controller: Controller, tool: int, dx_mm: float, seconds: float
) -> ToolOffset:
    """Shift a tool; once the time is over, or this task is cancelled, stop the controller.

    A cancelled await leaves its thread running. Only a stop ends what the thread does, and the
    controller refuses everything until ``release_stop()``.
    """
    work = asyncio.ensure_future(asyncio.to_thread(shift, controller, tool, dx_mm))
    try:
        async with asyncio.timeout(seconds):
            return await asyncio.shield(work)
    except (TimeoutError, asyncio.CancelledError):
        await asyncio.get_running_loop().run_in_executor(STOPS, controller.stop)
        await asyncio.wait([work])  # it ends with StoppedError, or was done just before
        raise


async def serve(url: str) -> list[ToolOffset]:
    """Shift three tools of one cell at the same time: they wait for each other."""
    controller = await asyncio.to_thread(robolink.connect, url, wait_s=10.0)
    try:
        return await asyncio.gather(
            *(shift_within(controller, tool, 0.1, seconds=30.0) for tool in (1, 2, 3))
        )
    finally:
        await asyncio.to_thread(controller.close)


async def main(urls: Sequence[str]) -> None:
    """Serve all cells at once; a cell that does not answer keeps no other one waiting."""
    results = await asyncio.gather(*map(serve, urls), return_exceptions=True)
    for url, result in zip(urls, results, strict=True):
        print(url, result)


if __name__ == "__main__":
    asyncio.run(main(sys.argv[1:]))
