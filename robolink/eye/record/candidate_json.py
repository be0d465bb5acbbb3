"""What was found in a picture, as plain JSON and back."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any, Final

from robolink.eye.candidate import Candidate, CandidateRefusal, RefusalCode

__all__ = ["candidate_as_json", "candidate_of"]


def candidate_as_json(one: Candidate) -> dict[str, Any]:
    """Return a candidate as plain JSON, with its reasons."""
    return {
        **{key: value for key, value in asdict(one).items() if key != "refused"},
        "accepted": one.accepted,
        "refused": [
            {"code": refusal.code.value, "measured": refusal.measured, "limit": refusal.limit}
            for refusal in one.refused
        ],
    }


def candidate_of(said: Mapping[str, Any]) -> Candidate:
    """Return the candidate of such JSON.

    Raises:
        KeyError, TypeError, ValueError: It is none.
    """
    refused = tuple(
        CandidateRefusal(RefusalCode(one["code"]), one["measured"], one["limit"])
        for one in said["refused"]
    )
    known = {key: said[key] for key in _NUMBERS if key in said}
    return Candidate(**known, refused=refused)


_NUMBERS: Final = ("x_px", "y_px", "radius_px", "score", "rays", "edge_px", "bore_ratio")
