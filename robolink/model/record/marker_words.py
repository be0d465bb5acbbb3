"""What was begun, in the words of a person: what went over the wire is for records."""

from robolink.messages import tr
from robolink.model.record.outcomes import Marker, MarkerKind


def begun_in_words(marker: Marker) -> str:
    """Return what a marker was stored for, without the statement that was sent.

    Args:
        marker: Of a movement with its ``target`` (mm, degrees), of a tool that was written or
            selected, or of anything else, which says itself what it is.
    """
    details = marker.details
    target = details.get("target")
    if marker.kind is MarkerKind.MOVE:
        if not isinstance(target, list) or len(target) < 4:
            return tr("a movement")
        x, y, z, u = (float(value) for value in target[:4])
        return tr("a movement to X {x:.3f} Y {y:.3f} Z {z:.3f} U {u:.3f}", x=x, y=y, z=z, u=u)
    if marker.kind is MarkerKind.SET and isinstance(details.get("select"), int):
        return tr("selecting tool {tool}", tool=details["select"])
    if marker.kind is MarkerKind.SET and isinstance(details.get("tool"), int):
        if details.get("requested") is None:
            return tr("clearing tool {tool}", tool=details["tool"])
        return tr("writing tool {tool}", tool=details["tool"])
    return marker.request
