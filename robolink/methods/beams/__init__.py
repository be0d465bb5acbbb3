"""beams: two crossed light beams."""

from dataclasses import asdict, replace
from typing import TYPE_CHECKING

from robolink.messages import declared
from robolink.methods.beams.parameters import BeamsParameters
from robolink.methods.declaration.method import Method, Needs
from robolink.methods.declaration.site import Site
from robolink.stations import StationKind

if TYPE_CHECKING:
    from robolink.procedures import KeptProof, TipSource


def _source(parameters: BeamsParameters, site: Site) -> "TipSource":
    from robolink.methods.beams.source import BeamsSource
    from robolink.stations import beam_station

    station = site.station
    if parameters.beams is not None:
        stated = site.stating(
            beams=tuple(asdict(line) for line in parameters.beams),
            off_when_broken=parameters.off_when_broken,
        )
        station = replace(stated, z_mm=parameters.z_mm)
    return BeamsSource(beam_station(station), parameters, sigma_mm=site.sigma_mm)


def _proof() -> "type[KeptProof]":
    from robolink.methods.beams.proof import CrossingTest

    return CrossingTest


METHOD = Method(
    name="beams",
    summary=declared("Drive the tip through two crossed light beams: X and Y."),
    description=declared(
        "Drive the tip through two crossed light beams: X and Y; nobody touches anything.\n\n"
        "As soon as the crossings check each other it says after each how well they agree and what "
        "X and Y are repeatable to. At the end the one that fits worst is named and may be made "
        "again.\n\n"
        "The station is declared in the cell file, or was learnt with 'station learn'. Afterwards "
        "the tip turns half a turn about itself and crosses the beams again."
    ),
    parameters=BeamsParameters,
    measures=("x_mm", "y_mm"),
    needs=Needs(station=StationKind.BEAMS),
    source=_source,
    unmeasured_z=declared('cannot be "measured" with beams; write "typed" or "kept"'),
    proof=_proof,
)
