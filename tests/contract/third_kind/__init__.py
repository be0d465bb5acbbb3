"""A third kind of controller, as another package would bring it: what a new kind takes.

``bench_server.py`` is the machine, which speaks a line protocol of its own on a socket. The driver
is ``bench_link.py`` (what goes over the wire) and ``bench_controller.py`` (what it means). An entry
point would read::

    [project.entry-points."robolink.controllers"]
    bench = "bench_package.bench_controller:open_bench"
"""

from tests.contract.third_kind.bench_controller import BenchController as BenchController
from tests.contract.third_kind.bench_controller import open_bench as open_bench
from tests.contract.third_kind.bench_server import BenchServer as BenchServer
