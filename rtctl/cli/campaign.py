"""`rtctl campaign`: random rigs, faults and commands against the invariants of the safety contract."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rtctl.cli.json_text import end_with
from rtctl.cli.number import Number
from rtctl.cli.outputs import OutputFile
from rtctl.cli.unread import refuse_unread

if TYPE_CHECKING:
    from rtctl.simulation.campaign_run import Order, Result

Bar = Callable[[int, str], AbstractContextManager[Callable[[int], None]]]
Told = tuple[str, dict[str, Any], Sequence[object]]
"""What was found: for people, for JSON, and what is broken."""

READ = {
    "margins": (),
    "still": ("index", "policies", "hold_s"),
    "admittance": ("index", "first"),
    "": ("ticks", "faults", "passive", "index", "trace"),
}
"""Parameters that each campaign reads beside those that all read; the last one is that without a name."""


@click.command("campaign")
@click.option("--seed", type=click.IntRange(0), default=1, help="of everything random")
@click.option("--rigs", type=click.IntRange(1, 1_000_000), default=1000, help="random rigs")
@click.option("--ticks", type=click.IntRange(1, 10_000_000), default=10_000, help="of each rig (1 ms)")
@click.option("--faults", type=click.IntRange(0, 32), default=10, help="scheduled on each rig")
@click.option(
    "--passive", is_flag=True, help="nothing broken, environment and hand passive: the energy claim is judged"
)
@click.option("--jobs", type=click.IntRange(0, 256), default=0, help="processes; 0: one per core")
@click.option("--rig", "index", type=click.IntRange(0), help="only this rig, in this process")
@click.option(
    "--trace", type=OutputFile(), help="with --rig: write its last 2000 ticks here (npz, the tick's fields)"
)
@click.option(
    "--margins",
    is_flag=True,
    help="linear rigs instead: is what `rtctl check` certifies stable, and how far is what it refuses from "
    "unstable",
)
@click.option(
    "--still",
    is_flag=True,
    help="passive hands that hold still after a motion instead, on joints of all kinds: does one feel "
    "anything",
)
@click.option(
    "--admittance",
    is_flag=True,
    help="certified admittance displays of all kinds of joints instead, each in 20 hands of its box: does "
    "one shake",
)
@click.option(
    "--first",
    type=click.IntRange(0),
    default=0,
    help="with --admittance: number of the first rig, to go on where another run ended",
)
@click.option(
    "--policy", "policies", multiple=True, metavar="NAME", help="with --still: friction.policy, once or more"
)
@click.option("--hold-s", type=Number(5, 3600), default=5.0, help="with --still: how long the hand holds")
@click.option("--json", "as_json", is_flag=True, help="one JSON object on stdout")
def command(
    *,
    seed: int,
    rigs: int,
    ticks: int,
    faults: int,
    passive: bool,
    jobs: int,
    index: int | None,
    trace: Path | None,
    margins: bool,
    still: bool,
    admittance: bool,
    first: int,
    policies: tuple[str, ...],
    hold_s: float,
    as_json: bool,
) -> None:
    """Prove the safety contract by volume.

    Compiled rigs of random inertia, friction, delay, encoder, coupling, environment and hand run the very
    law the daemon runs, while faults, late ticks, wrong targets and requests rain on them. An oracle that
    shares no code with the law judges every tick. A violated invariant is printed with the command that
    shows it again; the exit status is then 1."""
    # in the order of `READ`, whose last row is the campaign without a name: there is no flag for it
    chosen = [mode for mode, asked in zip(READ, (margins, still, admittance), strict=False) if asked]
    if len(chosen) > 1:
        raise click.UsageError(f"--{chosen[0]} and --{chosen[1]} are two campaigns: one at a time")
    mode = chosen[0] if chosen else ""
    # before any rig is run
    refuse_unread(
        set().union(*READ.values()) - set(READ[mode]),
        f"means nothing with --{mode}" if mode else "belongs to another campaign: --help says to which",
    )
    if index is not None:
        refuse_unread({"rigs", "jobs", "first"}, "means nothing with --rig: that one alone is run")
    # after what is unread: with --still it would ask for a --rig that makes --trace no better
    elif trace:
        raise click.UsageError("--trace is of one rig: give its --rig too")
    bar = partial(_bar, quiet=as_json)  # standard output is one object then, and the terminal quiet
    if margins:
        text, result, broken = _margins(rigs, seed, jobs, bar)
    elif still:
        text, result, broken = _still(rigs, seed, jobs, index, policies, hold_s, bar)
    elif admittance:
        text, result, broken = _admittance(rigs, seed, jobs, first, index, bar)
    else:
        from rtctl.simulation import campaign_run as campaign

        # all that a rig follows from, beside its number: what is printed with a violation
        order = campaign.Order(seed, rigs, ticks, faults, passive)
        if index is not None:
            found = _one(order, index, trace)
        else:
            with bar(rigs, "rigs") as done:
                found = campaign.run(order, jobs, done)
        text, result, broken = _text(found), found.as_dict(), found.violations
    if as_json:
        end_with(result, 1 if broken else 0)
    click.echo(text)
    if broken:
        sys.exit(1)


@contextmanager
def _bar(length: int, label: str, *, quiet: bool) -> Iterator[Callable[[int], None]]:
    """A bar on a person's terminal; what it gives is told how many were done since."""
    # a file or pipe would get a line for each step of the bar
    hidden = quiet or not sys.stderr.isatty()
    with click.progressbar(length=length, label=label, file=sys.stderr, hidden=hidden) as bar:
        yield bar.update


def _margins(rigs: int, seed: int, jobs: int, bar: Bar) -> Told:
    from rtctl.simulation import campaign_margins

    with bar(rigs, "rigs") as done:
        found = campaign_margins.run(rigs, seed, jobs, done)
    return found.text(), found.as_dict(), found.shaking


def _admittance(rigs: int, seed: int, jobs: int, first: int, index: int | None, bar: Bar) -> Told:
    from rtctl.simulation import campaign_in_hands

    if index is not None:
        # in this process: whoever looks at one rig wants a debugger, or its first error
        found = campaign_in_hands.Findings()
        found.add(*campaign_in_hands.run_rig(seed, index))
    else:
        with bar(rigs, "rigs") as done:
            found = campaign_in_hands.run(rigs, seed, jobs, done, first)
    return found.text(seed), found.as_dict(), found.shaking


def _still(
    cases: int, seed: int, jobs: int, index: int | None, policies: tuple[str, ...], hold_s: float, bar: Bar
) -> Told:
    from rtctl.control.vocabulary import Policy
    from rtctl.simulation import campaign_still, campaign_still_cases

    for name in policies:
        # as rig files spell them: the name goes into one
        known = [policy.name.lower() for policy in Policy]
        if name not in known:  # before anything is simulated
            raise click.BadParameter(
                f"no policy {name!r}; there are: {', '.join(known)}", param_hint="--policy"
            )
    order = campaign_still.Order(seed, cases, hold_s, policies or campaign_still_cases.POLICIES)
    if index is not None:
        found = campaign_still.Findings()
        found.add(
            [campaign_still.run_case(campaign_still_cases.drawn(seed, index, order.policies), hold_s)], hold_s
        )
    else:
        with bar(cases, "hands") as done:
            found = campaign_still.run(order, jobs, done)
    return found.text(order), found.as_dict(), found.loud


def _one(order: Order, index: int, trace: Path | None) -> Result:
    from rtctl.simulation import campaign_run as campaign

    # one run for verdict and trace: what is traced is what was judged
    result, rig, last = campaign.run_traced(order, index)
    for name in rig.faults:
        # what was rained on this rig, beside the object on standard output
        click.echo(f"fault {name}", err=True)
    if trace is not None:
        campaign.save_trace(trace, last)
        click.echo(f"{len(last)} ticks -> {trace}", err=True)  # beside the object on standard output
    return result


def _text(result: Result) -> str:
    # names for numbers, as in JSON: one source for both
    body = result.as_dict()
    lines = [f"{result.rigs} rigs, {result.ticks:,} ticks, {result.faults_scheduled:,} faults scheduled"]
    if result.seconds > 0:  # of one rig alone nobody took the time
        lines[0] += f", {result.seconds:.1f} s ({result.ticks / result.seconds:,.0f} ticks/s)"
    # what was hardly visited proves little: the sums tell how much of the machine was met
    for key in ("ticks_in_state", "axis_ticks_in_program", "faults_appeared"):
        counts = body[key]
        assert isinstance(counts, dict)
        lines.append(
            key.replace("_", " ") + ": " + ", ".join(f"{name} {n:,}" for name, n in counts.items() if n)
        )
    # twenty are as many as one can read; each bears the command that shows it again
    lines += [violation.text() for violation in result.violations[:20]]
    lines.append(f"{len(result.violations)} rigs violated an invariant")
    return "\n".join(lines)
