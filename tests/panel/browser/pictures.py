"""The pictures of the pages in ``docs/pictures``: ``python -m tests.panel.browser.pictures``.

A tablet of 1024 by 600, drawn smaller, with few colours: a page of text needs no more.
"""

import shutil
import struct
import sys
import zlib
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from tests.panel.browser import samples
from tests.panel.browser.scripted import OPERATOR, ScriptedPanel
from tests.panel.browser.test_renders import documents

FOLDER: Final = Path(__file__).parents[3] / "docs" / "pictures"
SCALE: Final = 0.8
MOST_BYTES: Final = 60_000

PICTURES: Final = {
    "panel-cells": ("/overview", "en", False),
    "panel-touch": ("touch", "en", False),
    "panel-fit": ("fit", "en", False),
    "panel-values.zh": ("values", "zh", False),
    "panel-done": ("end", "en", True),
    "panel-lost": ("lost", "en", False),
}
"""Name of each: what it shows, in which language, and whether dark."""


def main() -> int:
    """Draw them all anew."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright, ScriptedPanel() as panel:
        browser = playwright.chromium.launch(
            executable_path=shutil.which("chromium"), args=["--no-sandbox"]
        )
        context = browser.new_context(
            viewport={"width": 1024, "height": 600}, device_scale_factor=SCALE
        )
        page = context.new_page()
        for name, (shows, language, dark) in PICTURES.items():
            panel.watcher = replace(OPERATOR, language=language, dark=dark)
            panel.documents = documents(language, dark)
            view = "touch" if shows == "lost" else shows
            if not shows.startswith("/"):
                panel.view = samples.views(language)[view]
            page.goto(panel.url if not shows.startswith("/") else _at(panel.url, shows))
            page.evaluate("document.body.classList.remove('silent')")
            if not shows.startswith("/"):
                page.wait_for_selector("body:not(.silent)")
            if shows == "lost":
                panel.frozen = True
                page.wait_for_selector("text=for 4 s")
            data = with_few_colours(page.screenshot())
            panel.frozen = False
            (FOLDER / f"{name}.png").write_bytes(data)
            sys.stdout.write(f"{name}: {len(data)} bytes\n")
        browser.close()
    return 0


def _at(url: str, path: str) -> str:
    return url.replace("/cell/line3", path)


def with_few_colours(png: bytes) -> bytes:
    """Return a picture with at most 256 colours, as a PNG with a palette."""
    wide, high, pixels = _pixels(png)
    rgb = pixels[:, :, :3].astype(np.uint32)
    whole = (rgb[:, :, 0] << 16) | (rgb[:, :, 1] << 8) | rgb[:, :, 2]
    colours, index, counts = np.unique(whole, return_inverse=True, return_counts=True)
    for bits in (5, 4, 3, 2):
        levels = ((colours[:, None] >> np.array([16, 8, 0])) & 255) >> (8 - bits)
        keys = (levels[:, 0] << 16) | (levels[:, 1] << 8) | levels[:, 2]
        found, group = np.unique(keys, return_inverse=True)
        if len(found) <= 256:
            break
    # Of colours that are alike the one that is there most often stands for all.
    order = np.argsort(counts)
    stands = np.zeros(len(found), np.uint32)
    stands[group[order]] = colours[order]
    palette = ((stands[:, None] >> np.array([16, 8, 0])) & 255).astype(np.uint8).tobytes()
    rows = group[index].reshape(high, wide).astype(np.uint8)
    packed = zlib.compress(b"".join(b"\0" + row.tobytes() for row in rows), 9)
    head = struct.pack(">IIBBBBB", wide, high, 8, 3, 0, 0, 0)
    parts = ((b"IHDR", head), (b"PLTE", palette), (b"IDAT", packed), (b"IEND", b""))
    return png[:8] + b"".join(_chunk(kind, data) for kind, data in parts)


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def _pixels(png: bytes) -> tuple[int, int, np.ndarray]:
    """Return width, height and the bytes of a PNG of 8 bits (RFC 2083, 6)."""
    at, packed, wide, high, depth = 8, b"", 0, 0, 0
    while at < len(png):
        (length,), kind = struct.unpack(">I", png[at : at + 4]), png[at + 4 : at + 8]
        data = png[at + 8 : at + 8 + length]
        if kind == b"IHDR":
            wide, high = struct.unpack(">II", data[:8])
            depth = {2: 3, 6: 4}[data[9]]
        packed += data if kind == b"IDAT" else b""
        at += 12 + length
    raw = zlib.decompress(packed)
    size = wide * depth
    before, rows = np.zeros(size, np.int32), []
    for row in range(high):
        start = row * (size + 1)
        line = np.frombuffer(raw, np.uint8, size, start + 1).astype(np.int32)
        before = _unfiltered(raw[start], line, before, depth)
        rows.append(before)
    return wide, high, np.array(rows, np.uint8).reshape(high, wide, depth)


def _unfiltered(kind: int, line: np.ndarray, above: np.ndarray, depth: int) -> np.ndarray:
    if kind in (0, 2):
        return (line + (above if kind else 0)) & 255
    out = line.copy()
    if kind == 1:
        for channel in range(depth):
            out[channel::depth] = np.cumsum(line[channel::depth]) & 255
        return out
    for at in range(len(line)):
        left = int(out[at - depth]) if at >= depth else 0
        up, corner = int(above[at]), int(above[at - depth]) if at >= depth else 0
        if kind == 3:
            guess = (left + up) // 2
        else:
            far = [abs(up - corner), abs(left - corner), abs(left + up - 2 * corner)]
            guess = (left, up, corner)[far.index(min(far))]
        out[at] = (line[at] + guess) & 255
    return out


if __name__ == "__main__":
    sys.exit(main())
