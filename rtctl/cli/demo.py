"""`rtctl demo`: what `make run` shows."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from hw.motion import name, words
from rtctl.cli.invocation import as_run, shown
from rtctl.cli.json_text import end_with
from rtctl.cli.number import Number
from rtctl.cli.outputs import OutputFile
from rtctl.simulation.shipped_files import shipped


@click.command("demo")
@click.option("--config", type=click.Path(path_type=Path), help="another simulated rig than the shipped mock")
@click.option("--measure", type=Number(1, 600), default=8.0, help="seconds per phase")
@click.option(
    "--plot", type=OutputFile(picture=True), help="also draw the torque of the hand (PNG, PDF, SVG)"
)
@click.option("--json", "as_json", is_flag=True, help="end with one JSON object on stdout")
def command(config: Path | None, measure: float, plot: Path | None, *, as_json: bool) -> None:
    """Feel the difference: a simulated hand moves a simulated rig, friction compensation off, then on."""
    from rtctl.cli.demo_run import Demo
    from rtctl.errors import ConfigError, FaultError
    from rtctl.host.supervisor import Host
    from rtctl.rig_file.config import load
    from rtctl.simulation.shipped_files import shipped_config

    loaded = load(config or shipped_config("mock.toml"))
    if not loaded.config.simulated:
        raise ConfigError(f"{loaded.path}: the demonstration arms by itself, so it runs simulated rigs only")
    motion = loaded.config.axis[0].motion
    demo = Demo(loaded.config.loop.rate_hz, measure, _progress(quiet=as_json, motion=motion))
    if not as_json:
        click.echo(
            f"The rig of {loaded.path.name}: a simulated "
            f"{'carriage with' if motion == 'linear' else 'joint with gearbox'} friction, moved by a "
            "simulated hand,"
        )
        click.echo(
            f"controlled in real time at {loaded.config.loop.rate_hz:g} Hz. Friction compensation off, then "
            "on."
        )
    # the same host as of any rig: what is shown is the daemon, and no simulation of it
    with Host(loaded, observers=[demo], announce=lambda text: click.echo(f"rtctl: {text}", err=True)) as host:
        summary = host.run()
    off, on = (phase.rms_nm() for phase in demo.phases)
    # without a force sensor nothing is felt, of which nothing is a share
    felt = {"off": off, "on": on, "reduction": 1 - on / off if off else math.nan}
    summary[name("hand_torque_rms_nm", motion)] = felt
    if plot is not None:
        from rtctl.cli.demo_figure import draw

        draw(plot, *demo.trace(), demo.switch_s, (off, on), motion)
        summary["picture"] = str(plot)
    ended = FaultError if summary["fault_first"] else 130 if not all(one.count for one in demo.phases) else 0
    if as_json:
        end_with(summary, ended)
    click.echo("\n" + "\n".join(_table(summary, felt, motion)))
    if isinstance(ended, type):
        raise FaultError(f"the demonstration ended with a latched fault: {', '.join(summary['faults'])}")
    if ended:
        click.echo("rtctl: stopped before all was measured", err=True)
        sys.exit(ended)


def _progress(*, quiet: bool, motion: str) -> Callable[[float, float, str, float], None]:
    live = sys.stderr.isatty()
    # a pause ago: the first line comes at once
    last = [-2.0]

    def show(done_s: float, total_s: float, phase: str, rms_nm: float) -> None:
        # a log gets a line every two seconds, a terminal one line that is drawn anew
        if quiet or (not live and done_s - last[0] < 2.0):
            return
        last[0] = done_s
        # min: the last batch of ticks may reach beyond the end
        bar = "#" * round(30 * min(1.0, done_s / total_s))
        text = f"[{bar:<30}] {done_s:5.1f} of {total_s:.0f} s  compensation {phase:<3}"
        # NaN: nothing of this phase was measured yet
        text += "  settling" if rms_nm != rms_nm else words(f"  hand {rms_nm:.3f} N m rms", motion)
        # filled up: it covers the line before
        click.echo(f"\r{text:<90}" if live else text, err=True, nl=not live)

    return show


def _table(summary: dict[str, Any], felt: dict[str, float], motion: str) -> list[str]:
    wakeup, cycle = summary["wakeup_us"], summary["cycle_us"]
    torque = (
        "hand torque, RMS",
        *(f"  compensation {one:<6}{_figure(felt[one], '.4f')} N m" for one in ("off", "on")),
    )
    return [
        *(words(line, motion) for line in torque),
        f"  reduction          {_figure(100 * felt['reduction'], '.1f')} %",
        f"ticks                {summary['ticks']} at {summary['rate_hz']:g} Hz, {summary['missed_ticks']} "
        "missed",
        "wake-up latency, us  " + "  ".join(f"{name} {value:g}" for name, value in wakeup.items()),
        "work per cycle, us   " + "  ".join(f"{name} {value:g}" for name, value in cycle.items()),
        f"state at the end     {summary['state']}, faults: {', '.join(summary['faults']) or 'none'}",
        *([f"picture              {summary['picture']}"] if "picture" in summary else []),
        "",
        "Where to look next",
        *_next(
            f"rtctl run {shown(shipped('configs/mock-spring.toml'))} --arm",
            "another rig; in a second terminal: rtctl monitor",
        ),
        *_next(
            f"rtctl check {shown(shipped('configs/mock.toml'))}", "why this coupling is stable with any hand"
        ),
        *_next(shown(shipped("docs/protocol.md")), "write a virtual world in any language"),
    ]


def _figure(value: float, form: str) -> str:
    return format(value, form) if math.isfinite(value) else "-"


def _next(command: str, why: str) -> list[str]:
    return [f"  {as_run(command)}", f"      {as_run(why)}"]
