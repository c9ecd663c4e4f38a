"""What two later maps of a motor can tell of a model of its cogging: `python -m tests.bench.cogging_floor
--data FOLDER`.

FOLDER has `map_a.csv.gz`, `map_c_half_turn_off.csv.gz` and `map_reverse.csv.gz`: places in counts of a turn
and holding currents. No model of the place alone errs less on a map than its rows scatter, and none that is
only shifted less than the first map itself, moved to where it fits best, with a level of its own.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import click
import numpy as np

COUNTS = 8192
STRONGEST = 6
BLOCK = 32
DRAWS = 400


def columns(place: np.ndarray, orders: np.ndarray) -> np.ndarray:
    """One and the waves of a place."""
    turn = 2 * np.pi * place / COUNTS
    return np.column_stack([np.ones(len(turn)), *(f(k * turn) for k in orders for f in (np.cos, np.sin))])


def waves(coefficients: np.ndarray) -> np.ndarray:
    """Amplitude of each wave."""
    return np.asarray(np.hypot(coefficients[1::2], coefficients[2::2]))


def held_out(place: np.ndarray, current: np.ndarray, count: int) -> float:
    """RMS error of the first `count` waves of a map on every eighth of its own rows, learned from the
    others.
    """
    matrix, off = columns(place, np.arange(1, count + 1)), np.empty(len(current))
    for k in range(8):
        out = np.arange(len(current)) % 8 == k
        off[out] = current[out] - matrix[out] @ np.linalg.lstsq(matrix[~out], current[~out], rcond=None)[0]
    return float(off.std())


def moved(
    first: tuple[np.ndarray, np.ndarray], later: tuple[np.ndarray, np.ndarray]
) -> tuple[float, int, int, float]:
    """RMS difference, A, of two maps of as many even places where the first, moved, fits best, and the counts
    it is moved by; the wave in which they differ most and its share of the mean square.
    """
    rows = len(first[0])
    order = np.arange(rows // 2 + 1)
    was, now = (np.fft.rfft(current) for _, current in (first, later))
    now = now * np.exp(-2j * np.pi * order * later[0][0] / COUNTS)
    was, now = was[1:-1], now[1:-1]  # the level is left out: friction
    turned = np.exp(-2j * np.pi * np.arange(COUNTS)[:, None] * order[1:-1] / COUNTS)
    off = np.abs(now - turned * was) ** 2
    at = int(np.argmin(off.sum(axis=1)))
    most = int(np.argmax(off[at]))
    return float(np.sqrt(2 * off[at].sum()) / rows), at, most + 1, float(off[at, most] / off[at].sum())


def main() -> None:
    """Print what each map scatters by, and how far the waves of the first are from those of the reverse
    run.
    """
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, required=True)
    folder = parser.parse_args().data
    maps: dict[str, tuple[np.ndarray, np.ndarray]] = {}
    for name in ("map_a", "map_c_half_turn_off", "map_reverse"):
        table = np.genfromtxt(folder / f"{name}.csv.gz", delimiter=",", skip_header=1)
        place, current = table[np.argsort(table[:, 0])].T
        maps[name] = place, current
        scatter = float(np.diff(current, 2).std() / np.sqrt(6))
        own = min(held_out(place, current, count) for count in (8, 16, 32, 64, 96))
        click.echo(
            f"{name}: neighbouring rows scatter by {scatter:.3f} A; its own waves leave {own:.3f} A of rows "
            "held out"
        )
    for name in ("map_c_half_turn_off", "map_reverse"):
        off, at, wave, share = moved(maps["map_a"], maps[name])
        click.echo(
            f"{name}: map_a itself, moved by {at} counts, is {off:.3f} A from it; {share:.0%} of that is "
            f"in its wave {wave}"
        )
    (place, current), (other, reverse) = maps["map_a"], maps["map_reverse"]
    every = np.arange(1, 49)
    learned = np.linalg.lstsq(columns(place, every), current, rcond=None)[0]
    strongest = np.sort(np.argsort(waves(learned))[::-1][:STRONGEST] + 1)
    learned = np.linalg.lstsq(columns(place, strongest), current, rcond=None)[0]
    left = {
        shift: float(np.std(reverse - columns(other + shift, strongest) @ learned))
        for shift in range(0, COUNTS, 4)
    }
    shift = min(left, key=left.__getitem__)
    matrix = columns(other + shift, strongest)
    found = np.linalg.lstsq(matrix, reverse, rcond=None)[0]
    apart, rest = waves(found - learned), reverse - matrix @ found
    rng, solve, drawn = np.random.default_rng(0), np.linalg.pinv(matrix), []
    for _ in range(DRAWS):
        begin = rng.integers(0, len(rest), len(rest) // BLOCK)
        rows = np.concatenate([(b + np.arange(BLOCK)) % len(rest) for b in begin])
        drawn.append(np.sqrt(np.sum(waves(solve @ rest[rows]) ** 2) / 2))
    click.echo(
        f"shift {shift} counts, {left[shift]:.3f} A left on rows; friction "
        f"{(found[0] - learned[0]) / 2:+.3f} A either way about {(found[0] + learned[0]) / 2:+.3f}"
    )
    click.echo(
        f"waves {', '.join(map(str, strongest))}: {np.sqrt(np.sum(apart**2) / 2):.3f} A RMS from those of "
        f"map a; the scatter of the reverse map alone makes {np.median(drawn):.3f} (nine of ten below "
        f"{np.quantile(drawn, 0.9):.3f})"
    )


if __name__ == "__main__":
    main()
