"""Names of before: how recipes that were written for robolink 0.1 are read.

A calibration method has one name now. The kinds of ``[source]`` of before are read for one version
more, and whoever uses one is told its name of now.
"""

from collections.abc import Iterator, Mapping
from typing import Any

from robolink.messages import tr
from robolink.methods import AnyMethod, Former, all_methods
from robolink.model import method_name_now


def with_names_of_now(document: Mapping[str, Any]) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Return a recipe with the names of now, and what to tell whoever wrote the ones of before.

    What is no name of before is left for the checks to find.
    """
    source = document.get("source")
    if not isinstance(source, Mapping):
        return dict(document), ()
    if source.get("kind") == "points":
        now, notes = _points(source)
    else:
        now, notes = _kind(source)
    return {**document, "source": now}, notes


def _points(source: Mapping[str, Any]) -> tuple[dict[str, Any], tuple[str, ...]]:
    method = source.get("method")
    if not isinstance(method, str) or method_name_now(method) == method:
        return dict(source), ()
    now = method_name_now(method)
    return {**source, "method": now}, (_note("method", method, now),)


def _kind(source: Mapping[str, Any]) -> tuple[dict[str, Any], tuple[str, ...]]:
    found = next(_meant(source), None)
    if found is None:
        return dict(source), ()
    method, former = found
    now = {key: value for key, value in source.items() if not former.method or key != "method"}
    return {**now, "kind": method.name}, (_note("kind", former.kind, method.name),)


def _meant(source: Mapping[str, Any]) -> Iterator[tuple[AnyMethod, Former]]:
    for method in all_methods():
        for former in method.formerly:
            if former.kind == source.get("kind") and (
                not former.method
                or source.get("method", former.method if former.usual else None) == former.method
            ):
                yield method, former


def _note(key: str, before: str, now: str) -> str:
    return tr(
        'source.{key}: "{before}" is an old name, which the next version does not know; write '
        '{key} = "{now}".',
        key=key,
        before=before,
        now=now,
    )
