"""The picture of the demonstration: torque of the hand before and after the compensation is switched on."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from hw.motion import words
from rtctl import pictures

AROUND_S = 4.0
"""Shown on either side of the switch."""

OFF, ON, INK = "#c2410c", "#1d4ed8", "#1f2937"


def draw(
    path: str | Path,
    time_s: np.ndarray,
    hand_torque_nm: np.ndarray,
    switch_s: float,
    rms_nm: Sequence[float],
    motion: str = "rotary",
) -> None:
    """Draw the torque of the hand around the switch to a PNG, PDF or SVG file.

    Parameters
    ----------
    time_s, hand_torque_nm : ndarray, shape (n,)
        Samples of the whole demonstration, s and N m.
    switch_s : float
        When the compensation was switched on, s.
    rms_nm : sequence of 2
        RMS without and with, N m, for the legend.
    motion : str
        Of the axis, in whose units the picture is.

    Raises
    ------
    DataError
        When the file cannot be written.

    Notes
    -----
    The paper is white and opaque, so that the picture is legible on a dark page, too; an SVG has no date in
    it."""
    from matplotlib import rc_context

    after = time_s - switch_s
    # text as text, and the same ids each time: the file differs only where the curve does
    with rc_context({"svg.fonttype": "none", "svg.hashsalt": "rtctl", "font.size": 9, "text.color": INK}):
        figure = pictures.blank(6.4, 2.3, facecolor="white")
        plot = figure.subplots()
        for name, colour, value, part in (
            ("off", OFF, rms_nm[0], (after >= -AROUND_S) & (after < 0)),
            ("on", ON, rms_nm[1], (after >= 0) & (after <= AROUND_S)),
        ):
            label = words(f"compensation {name}: {value:.3f} N m RMS", motion)
            # two curves that meet at the switch: a single one has one colour
            plot.plot(after[part], hand_torque_nm[part], color=colour, linewidth=1.3, label=label)
        plot.axvline(0.0, color=INK, linewidth=0.8, linestyle=":")
        # as much on either side, and nothing of the start
        plot.set_xlim(-AROUND_S, AROUND_S)
        plot.set_xlabel("time from the switch, s")
        plot.set_ylabel(words("torque of the hand, N m", motion))
        plot.spines[["top", "right"]].set_visible(False)
        plot.legend(loc="upper right", frameon=False)
        pictures.save(figure, path, metadata={"Date": None} if str(path).endswith(".svg") else None)
