"""What `rtctl identify` says at its end."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import click

from rtctl.cli.invocation import as_run, shown

if TYPE_CHECKING:
    from rtctl.friction.presliding import Presliding
    from rtctl.identify.dataset import Dataset
    from rtctl.rig_file.config import LoadedConfig
    from rtctl.simulation.friction_truth import Deviation


def true_deviations(loaded: LoadedConfig, axis: int, dataset: Dataset) -> tuple[Deviation, ...]:
    """How far the points are from the simulated rig's own friction law; empty where none is known."""
    from rtctl.simulation import friction_truth

    if not friction_truth.is_known(loaded):
        return ()
    points = dataset.document["points"]
    # a break-away is measured at rest, whatever the last counts say
    velocities = [point["target_rad_s"] and point["velocity_rad_s"] for point in points]
    torques = [point["friction_torque_nm"] for point in points]
    directions = [point["direction"] for point in points]
    return friction_truth.of_points(loaded, axis, zip(velocities, torques, directions, strict=True))


def summary_of(dataset: Dataset, wall_s: float, truth: tuple[Deviation, ...]) -> dict[str, Any]:
    """What there is now, under the names of a rotary axis; `wall_s` is how long it took."""
    document = dataset.document
    points = document["points"]
    bent = _presliding(points)
    return {
        "dataset": str(dataset.folder),
        "rig": document["rig"],
        "motion": document.get("motion", "rotary"),
        "complete": document["complete"],
        "points": len(points),
        # those that were left out with a reason count as wanted
        "points_wanted": len(points) + len(document["skipped"]) + len(dataset.left),
        "skipped": document["skipped"],
        "train": sum(point["use"] == "train" for point in points),
        "test": sum(point["use"] == "test" for point in points),
        "measurements": sum(point["count"] for point in points),
        "discarded": sum(point["discarded"] for point in points),
        "late": sum(point.get("late", 0) for point in points),
        "worst_std_nm": max((point["std_nm"] for point in points), default=None),
        "presliding": asdict(bent) if bent else None,
        # of the last session: each reads the sensor's zero anew
        "bias": document["sessions"][-1]["bias"] if document["sessions"] else None,
        "wall_s": round(wall_s, 2),
        "truth": [asdict(one) for one in truth],
    }


TOO_SHORT = (
    "the encoder is too coarse for it, or the joint hardly bends before it slides. A long one is assumed, "
    "which is safe and helps less; friction.presliding_rad says what the joint has"
)
"""Why ramps that broke away showed no length, and what to do about it."""


def _presliding(points: list[dict[str, Any]]) -> Presliding | None:
    from rtctl.friction.presliding import Presliding, together

    return together(
        [
            Presliding(point["presliding_rad"], point["presliding_spread_rad"], point["presliding_ramps"])
            for point in points
            if point.get("presliding_rad")
        ]
    )


def tell(dataset: Dataset, summary: dict[str, Any], truth: tuple[Deviation, ...], *, complete: bool) -> None:
    """Tell a person, in the units of a rotary axis."""
    document = dataset.document
    points = document["points"]
    click.echo(
        f"{len(points)} of {summary['points_wanted']} points in {dataset.folder}, {summary['wall_s']:.0f} s"
    )
    for one in document["skipped"]:
        click.echo(f"left out: {one['why']}")
    if summary["late"]:
        click.echo(
            f"{summary['late']} tries and measurements were repeated because this program's ticks came late "
            "(rtctl doctor tells what the machine can do about it)"
        )
    if points:
        seen = any(one["target_rad_s"] == 0 for one in points)
        why = TOO_SHORT if seen else "no break-away was measured"
        click.echo(f"presliding length: {_presliding(points) or f'not known: {why}'}")
    if truth:
        click.echo("points against the true friction of the simulated rig:")
    for one in truth:
        click.echo(f"  {one}, {one.speeds} speeds")
    if complete:
        click.echo(
            as_run(
                f"next: rtctl fit {shown(dataset.folder / 'points_train.csv')} --rig {document['rig']} "
                f"--out {shown(dataset.folder / 'model.json')}"
            )
        )
