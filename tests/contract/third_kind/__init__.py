"""A third-party kind of controller, and all that a new kind needs.

``bench_server.py`` is the machine, which speaks its own line protocol on a socket. The driver is
``bench_link.py`` (the exchanges) and ``bench_controller.py`` (their meaning). An entry point would
read::

    [project.entry-points."robolink.controllers"]
    bench = "bench_package.bench_controller:open_bench"
"""

from tests.contract.third_kind.bench_controller import BenchController as BenchController
from tests.contract.third_kind.bench_controller import open_bench as open_bench
from tests.contract.third_kind.bench_server import BenchServer as BenchServer
