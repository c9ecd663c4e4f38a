"""The whole identification, many times over: does what is learned hold on other speeds, and how many numbers
does it take?

One identification has 28 test points in each direction, half of them slow ones with three times the noise of
the fast: its ratio of prediction to training error scatters by a seventh by chance alone. Only the mean over
many says whether noise was learned."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from rtctl.errors import DataError
from rtctl.experiments.order import Order
from rtctl.experiments.report import Outcome, Part, Target
from rtctl.experiments.simulated_identification import drive
from rtctl.experiments.statistics import Estimate, estimate
from rtctl.friction.learn import ladder, report_evidence, report_tables
from rtctl.friction.learn.pool import workers
from rtctl.friction.learn.report_tables import Table
from rtctl.friction.points import FrictionPoints
from rtctl.identify.bias import Bias
from rtctl.identify.measurement_order import Known, Task
from rtctl.identify.place_rows import Row
from rtctl.identify.session import Point, identify
from rtctl.identify.settings import Settings, rig_of, settings_of, without_feedforward
from rtctl.identify.tick_readings import Measurement
from rtctl.rig_file.config import LoadedConfig
from rtctl.simulation import friction_truth
from rtctl.simulation.closed_loop import Simulation

TITLE = "Identification, repeated"
FAMILIES = ("tustin", "gaussian", "lorentzian", "epsilon-spline", "nu-spline", "epsilon-rbf", "nu-rbf")
RATIO_MOST = 1.15
VECTORS_MOST = {"spline": 12, "rbf": 30}
DEVIATION_MOST = 0.02
CHOSEN = "chosen"
"""Name of the row of whatever the ladder chose."""


@dataclass
class Kept:
    """Store of an identification that keeps its points and nothing else."""

    points: list[Point] = field(default_factory=list)
    motion: str = "rotary"

    def has(self, _task: Task) -> bool:
        """Nothing is there before."""
        return False

    def begin(self, bias: Bias) -> None:
        """Nobody asks for the bias later."""

    def warmed_up(self) -> None:
        """Nobody asks for the ticks later."""

    def skip(self, _task: Task, _why: str) -> None:
        """A point less."""

    def known(self) -> list[Known]:
        """Points so far."""
        return [
            Known(one.direction, abs(one.target_rad_s), abs(one.friction_torque_nm), one.presliding_rad)
            for one in self.points
        ]

    def lacks_sweep(self) -> bool:
        """Nobody asks for a sweep."""
        return False

    def swept(self, _rows: Sequence[Row]) -> None:
        """Nobody asks for a sweep."""

    def add(self, point: Point, _measurements: Sequence[Measurement]) -> None:
        """Keep a point."""
        self.points.append(point)

    def of(self, use: str) -> FrictionPoints:
        """Points of one use, "train" or "test"."""
        rows = [
            (
                # break-away is at rest: the speed at which it let go is none of the curve's
                one.velocity_rad_s if one.target_rad_s else 0.0,
                abs(one.friction_torque_nm),
                one.direction,
                one.std_nm,
                one.count,
            )
            for one in self.points
            if one.use == use
        ]
        points = FrictionPoints.from_rows(rows, f"identified on the simulated rig, to {use}", "")
        return replace(points, motion=self.motion)


def run(order: Order) -> Outcome:
    """Identify with every seed, climb the ladder each time, judge every rung on the test points of the same
    run.

    Seed k of n: the rig's own seed plus k, for the noise of the sensors, the order of the speeds and the
    places.

    Raises
    ------
    ConfigError, DataError
        Not a simulated rig; points that cannot be used."""
    order.require_simulated("identification")
    if order.points is not None:
        raise DataError(f"{order.points}: identification measures its own points; drop --points")
    import joblib

    first = int(order.loaded.options.get("seed", 0))
    seeds = [first + k for k in range(order.seeds)]
    # in the order of the seeds, whichever worker was first
    found: list[list[dict[str, Any]]] = []
    order.progress(0.0, "identifying")
    with workers("loky", min(len(seeds), joblib.cpu_count())) as pool:
        for rows in pool(joblib.delayed(repeat)(order.loaded, seed) for seed in seeds):
            found.append(rows)
            order.progress(len(found) / len(seeds), f"{len(found)} of {len(seeds)} identifications")
    return outcome(seeds, found)


def measured(loaded: LoadedConfig, seed: int, settings: Settings | None = None) -> Kept:
    """Points of one identification of the simulated rig, in this process; by the defaults of
    `rtctl identify`, unless told otherwise.

    Nobody holds the axis."""
    settings = settings or settings_of(loaded, {})
    # a hand on the axis would be measured as friction, or end the identification
    hands = [{**hand, "kind": "none"} for hand in loaded.options["hand"]]
    again = loaded.model_copy(update={"options": {**loaded.options, "seed": seed, "hand": hands}})
    # help would be measured as friction that is not there
    again = without_feedforward(again)
    settings = replace(settings, seed=seed)  # of the order of speeds, too
    rig, kept = rig_of(again, settings), Kept(motion=loaded.config.axis[0].motion)
    steps = identify(rig, settings, kept, lambda *_: None, lambda _text: None)
    drive(Simulation(again), steps, rig.axis)
    return kept


def repeat(
    loaded: LoadedConfig, seed: int, settings: Settings | None = None, families: Sequence[str] = FAMILIES
) -> list[dict[str, Any]]:
    """One identification and its ladder: a row per rung that was not refused, then one of the chosen rung."""
    kept = measured(loaded, seed, settings)
    train, test = kept.of("train"), kept.of("test")
    options = ladder.Options(
        families=tuple(families),
        strategy="full",
        symmetric="no",
        # seeds run beside each other already
        backend="sequential",
        n_jobs=1,
    )
    climbed = ladder.ascend(train, options)
    name = loaded.config.rig.name
    model = ladder.learn(train, climbed, rig=name)
    evidence = report_evidence.gather(train, model, climbed, test)
    rungs = {rung.family: rung for rung in climbed.choice.rungs}
    rows = []
    for row in report_tables.overall_rows(evidence):
        family = row["family"]
        one = ladder.learn(train, climbed, rig=name, rung=rungs[family])
        off = friction_truth.of_model(loaded, 0, one)
        # trained on all points: what a model file has, and not the mean over folds
        vectors = [branch.source.n_support_vectors for branch in one.branches]
        more = {"support_vectors": vectors, "off_share": max(deviation.rms_share for deviation in off)}
        rows.append({**row, **more, "seed": seed})
    # once more under a name of its own: it is another family in each identification
    chosen = next(row for row in rows if row["family"] == evidence.chosen)
    refused = {rung.family: rung.refused for rung in rungs.values() if rung.refused}
    return [*rows, {**chosen, "family": CHOSEN, "chosen": evidence.chosen, "refused": refused}]


def _refusals(rows: Sequence[dict[str, Any]]) -> str:
    """Say which rungs were passed over, in how many identifications, and why the first time."""
    families = dict.fromkeys(family for row in rows for family in row.get("refused", {}))
    said = ""
    for family in families:
        reasons = [row["refused"][family] for row in rows if family in row.get("refused", {})]
        said += f" {family} has no figure in {len(reasons)} of them: {reasons[0]}."
    return said


def outcome(seeds: Sequence[int], found: Sequence[Sequence[dict[str, Any]]]) -> Outcome:
    """Means over the seeds, against the figures asked for."""
    families = [*FAMILIES, CHOSEN]
    rows = {name: [row for rows in found for row in rows if row["family"] == name] for name in families}
    # a family that was refused in every run has no row
    rows = {name: mine for name, mine in rows.items() if mine}
    numbers = {name: _summary(mine) for name, mine in rows.items()}
    winners = sorted({row["chosen"] for row in rows[CHOSEN]})
    ratio = numbers[CHOSEN]["prediction_over_training"]
    several = f", seeds {seeds[0]} to {seeds[-1]}" if len(seeds) > 1 else f", seed {seeds[0]}"
    in_one = _span([row["prediction_over_training"] for row in rows[CHOSEN]], ".2f")
    key = (
        f"{len(seeds)} identification(s) of the simulated rig{several}. The chosen "
        f"model ({', '.join(winners)}) errs {ratio.text()} times as much on other speeds as on those it saw"
        # of one there is neither a mean nor an interval, and its ratio alone scatters by a seventh
        + (f", mean and 95 % interval; in one identification {in_one}." if len(seeds) > 1 else ".")
    )
    key += _refusals(rows[CHOSEN])
    table = Table(
        "Mean absolute errors over all speeds and both directions, mN m, as in Tables I and II of Bi, mean "
        "over the identifications with the 95 % interval; ratio of each identification, smallest to "
        "largest; support vectors trained on all points, both directions; largest RMS distance of the "
        "curve from the true friction, % of Coulomb friction.",
        ("model", "training", "prediction", "ratio", "in one run", "support vectors", "off the truth"),
        tuple(_cells(name, mine, numbers[name]) for name, mine in rows.items()),
    )
    body = {"seeds": list(seeds), "models": numbers, "runs": [row for rows in found for row in rows]}
    return Outcome(
        "identification", TITLE, key, (Part("Errors", (), (table,)),), _targets(rows, numbers), body
    )


def _summary(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    names = ("training_mean_error_nm", "prediction_mean_error_nm", "prediction_over_training")
    vectors = [max(row["support_vectors"]) for row in rows]
    return {
        **{name: estimate([row[name] for row in rows]) for name in names},
        "support_vectors": estimate(vectors),
        "support_vectors_most": max(vectors),
        # the worst: one curve that is off is one rig that is helped wrongly
        "off_share": max(row["off_share"] for row in rows),
        "runs": len(rows),
    }


def _cells(name: str, rows: Sequence[dict[str, Any]], summary: dict[str, Any]) -> tuple[str, ...]:
    vectors = [count for row in rows for count in row["support_vectors"]]
    return (
        name,
        summary["training_mean_error_nm"].text(1e3),
        summary["prediction_mean_error_nm"].text(1e3),
        summary["prediction_over_training"].text(),
        _span([row["prediction_over_training"] for row in rows], ".2f"),
        _span(vectors, "d") if any(vectors) else "-",
        f"{100 * summary['off_share']:.2f}",
    )


def _span(values: Sequence[float], shape: str) -> str:
    return f"{min(values):{shape}} to {max(values):{shape}}"


def _targets(rows: dict[str, list[dict[str, Any]]], numbers: dict[str, dict[str, Any]]) -> tuple[Target, ...]:
    targets = []
    for name in rows:
        measured_ratio: Estimate = numbers[name]["prediction_over_training"]
        said = f"{name}: prediction over training error"
        targets.append(Target(said, measured_ratio, RATIO_MOST, "", 1.0, at_most=True))
        kernel = name.rpartition("-")[2]
        if kernel in VECTORS_MOST:
            said = f"{name}: support vectors of the larger direction"
            count: Estimate = numbers[name]["support_vectors"]
            targets.append(Target(said, count, VECTORS_MOST[kernel], "", 1.0, at_most=True))
    off = estimate([row["off_share"] for row in rows[CHOSEN]])
    targets.append(
        Target(f"{CHOSEN}: RMS distance from the true friction", off, DEVIATION_MOST, at_most=True)
    )
    return tuple(targets)
