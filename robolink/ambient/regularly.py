"""Something that is done every so often beside what a thread does."""

import threading
from collections.abc import Callable


def in_a_thread(every_s: float, act: Callable[[], None], name: str) -> Callable[[], None]:
    """Have ``act`` called every so many seconds by a thread that ends with its process.

    Args:
        every_s: How often; the first time after so long.
        act: What is called; it raises nothing.
        name: Of the thread.

    Returns:
        What ends the thread, and waits for that.
    """
    ending = threading.Event()

    def run() -> None:
        while not ending.wait(every_s):
            act()

    thread = threading.Thread(target=run, name=name, daemon=True)
    thread.start()

    def end() -> None:
        ending.set()
        thread.join()

    return end
