"""The files of the page, and under which paths they are served."""

from __future__ import annotations

from pathlib import Path

STATIC = Path(__file__).parent / "view_static"
SCRIPTS = (
    "link.js",
    "head.js",
    "display.js",
    "drawings.js",
    "scene.js",
    "scope.js",
    "plot.js",
    "phase.js",
    "loop.js",
    "record.js",
    "view.js",
    "world.js",
)
PAGES = ("/", "/world")
FILES = {
    "/": ("index.html", "text/html; charset=utf-8"),
    "/world": ("world.html", "text/html; charset=utf-8"),
    "/view.css": ("view.css", "text/css"),
    **{f"/{name}": (name, "text/javascript") for name in SCRIPTS},
    "/uPlot.iife.min.js": ("uPlot.iife.min.js", "text/javascript"),
    "/uPlot.min.css": ("uPlot.min.css", "text/css"),
}
