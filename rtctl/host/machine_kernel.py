"""The kernel and the processor: how well they can keep the loop's time."""

from __future__ import annotations

import gzip
import os
import re
import zlib
from contextlib import suppress
from pathlib import Path

import numpy as np

from rtctl.host.exchange.late_trace import EVENTS
from rtctl.host.machine_line import Line, text
from rtctl.rt import early
from rtctl.rt.core import BUSY_HZ, Choice, cores_of, interrupts, since_start_s

# these are read without a system call (vDSO); hpet and acpi_pm are registers of a slow device
GOOD_CLOCKS = ("tsc", "arch_sys_counter", "kvm-clock", "hyperv_clocksource_tsc_page", "riscv_clocksource")
_CPU = Path("sys/devices/system/cpu")


def check(root: Path, chosen: Choice) -> list[Line]:
    """Everything about the machine; `chosen` is the loop's core."""
    core = chosen.core
    return [
        preemption(root),
        clock_source(root),
        core_present(root, chosen),
        governor(root, core),
        isolation(root, core),
        device_interrupts(root, core),
        idle_states(root),
        throttling(root),
        late_ticks(root),
    ]


def _boot_option(option: str) -> str:
    return (
        f"add {option} to GRUB_CMDLINE_LINUX_DEFAULT in /etc/default/grub, then: sudo update-grub && sudo "
        "reboot"
    )


def preemption(root: Path) -> Line:
    """The kernel's preemption model."""
    name = "kernel preemption"
    version = text(root / "proc/version") or ""
    command_line = text(root / "proc/cmdline") or ""
    if text(root / "sys/kernel/realtime") == "1" or "PREEMPT_RT" in version:
        return Line(name, "ok", "PREEMPT_RT")
    # named by distribution: no package of this name is everywhere
    rt = "sudo apt-get install linux-image-rt-amd64 (Debian), or sudo pro enable realtime-kernel (Ubuntu)"
    if "PREEMPT_DYNAMIC" in version:
        # debugfs is root's; for others the command line tells, else what the kernel was built with
        chosen = re.search(r"\((\w+)\)", text(root / "sys/kernel/debug/sched/preempt") or "")
        asked = re.search(r"(?:^|\s)preempt=(\w+)", command_line)
        model = chosen[1] if chosen else asked[1] if asked else _built(root)
        if model == "full":
            return Line(name, "ok", "full preemption (PREEMPT_DYNAMIC); PREEMPT_RT is better still")
        found = (
            f"PREEMPT_DYNAMIC, {model or 'model not readable'}: the loop may wait for a system call of any "
            "task"
        )
        return Line(name, "warn", found, f"{_boot_option('preempt=full')}; better: {rt}")
    if re.search(r"\bPREEMPT\b", version):
        return Line(name, "ok", "full preemption; PREEMPT_RT is better still")
    return Line(name, "warn", "no kernel preemption: wake-ups may be late by milliseconds", rt)


def _built(root: Path) -> str:
    """The preemption model that a kernel was built to begin with; empty where its configuration is not
    there."""
    # in /boot, for Debian's kernels have no /proc/config.gz (CONFIG_IKCONFIG)
    built = text(root / f"boot/config-{text(root / 'proc/sys/kernel/osrelease')}") or ""
    with suppress(OSError, EOFError, zlib.error):
        built = built or gzip.decompress((root / "proc/config.gz").read_bytes()).decode("ascii", "replace")
    found = re.search(r"^CONFIG_PREEMPT(?:_(NONE|VOLUNTARY|LAZY))?=y$", built, re.MULTILINE)
    return "" if found is None else (found[1] or "full").lower()


def clock_source(root: Path) -> Line:
    """What the kernel reads the time from: a slow source costs a microsecond at each reading."""
    current = text(root / "sys/devices/system/clocksource/clocksource0/current_clocksource")
    if current is None:
        return Line("clock source", "warn", "not readable", "look at dmesg | grep -i clocksource")
    if current in GOOD_CLOCKS:
        return Line("clock source", "ok", current)
    fix = (
        "sudo sh -c 'echo tsc > /sys/devices/system/clocksource/clocksource0/current_clocksource'; lasting: "
    )
    return Line("clock source", "warn", f"{current} is slow to read", fix + _boot_option("tsc=reliable"))


def core_present(root: Path, chosen: Choice) -> Line:
    """Whether the loop's core is there and switched on, and why it is that one."""
    core, online = chosen.core, cores_of(text(root / _CPU / "online") or "")
    if not online or core in online:
        return Line("loop core", "ok", f"core {core}: {chosen.why}")
    return Line(
        "loop core",
        "fail",
        f"core {core} is not online ({_span(online)})",
        "set loop.cpu to one of them, or -1",
    )


def governor(root: Path, core: int) -> Line:
    """Frequency scaling of the loop's core."""
    found = text(root / _CPU / f"cpu{core}/cpufreq/scaling_governor")
    if found is None:
        return Line("cpu governor", "ok", f"core {core} has no frequency scaling")
    if found == "performance":
        return Line("cpu governor", "ok", f"core {core}: performance")
    # of this core alone: on a laptop the others may save power
    fix = f"sudo cpupower -c {core} frequency-set -g performance (package linux-cpupower)"
    return Line("cpu governor", "warn", f"core {core}: {found}: wakes up slowly and unevenly", fix)


def isolation(root: Path, core: int) -> Line:
    """Whether other processes are kept off the loop's core."""
    isolated = cores_of(text(root / _CPU / "isolated") or "")
    if core in isolated:
        return Line("isolated cores", "ok", f"core {core} is isolated")
    # devices go to another core than the loop's
    options = f"isolcpus={core} nohz_full={core} rcu_nocbs={core} irqaffinity={0 if core else 1}"
    others = f" ({_span(isolated)} are; loop.cpu could name one)" if isolated else ""
    fix = f"{_boot_option(options)}; in the rig file: loop.cpu = {core}"
    return Line("isolated cores", "warn", f"core {core} is shared{others}", fix)


def device_interrupts(root: Path, core: int, since_s: float | None = None) -> Line:
    """Whose interrupts come to the loop's core: each takes some microseconds, and the work that the kernel
    puts off until after them takes more. `since_s`: how long they have been counted."""
    name, lines = "device interrupts", interrupts(root)
    if not any(core < len(line.counts) for line in lines.values()):
        return Line(name, "ok", "not told here")
    # max: just after the start less than one would name every interrupt that ever came
    busy = BUSY_HZ * max(since_start_s() if since_s is None else since_s, 1.0)
    often = {number: line for number, line in lines.items() if line.on(core) >= busy}
    if not often:
        return Line(name, "ok", f"none that comes often to core {core}")
    lists = " ".join(f"/proc/irq/{number}/smp_affinity_list" for number in often)
    fix = (
        f"echo {0 if core else 1} | sudo tee {lists} (until the next start; irqbalance moves them back "
        f"unless it is told IRQBALANCE_BANNED_CPULIST={core}); "
        "one that cannot be moved: another core for loop.cpu"
    )
    devices = ", ".join(sorted({line.devices for line in often.values()}))
    return Line(name, "warn", f"core {core} serves {devices}", fix)


def idle_states(root: Path) -> Line:
    """Whether the daemon may keep the processor out of deep idle states."""
    device = root / "dev/cpu_dma_latency"
    if not device.exists():
        return Line(
            "cpu_dma_latency", "warn", f"no {device}: deep idle states stay on", _boot_option("idle=poll")
        )
    if os.access(device, os.W_OK):
        return Line("cpu_dma_latency", "ok", "writable")
    rule = 'KERNEL=="cpu_dma_latency", GROUP="realtime", MODE="0660"'
    fix = (
        f"the service may (rtctl service install); for this shell: echo '{rule}' | sudo tee "
        "/etc/udev/rules.d/99-rtctl-latency.rules && sudo udevadm control --reload && sudo udevadm trigger "
        "-s misc"
    )
    return Line("cpu_dma_latency", "warn", "not writable by this user: wake-ups from deep idle states", fix)


def throttling(root: Path) -> Line:
    """The share of time real-time processes may take before the kernel holds them up."""
    folder = root / "proc/sys/kernel"
    runtime, period = text(folder / "sched_rt_runtime_us"), text(folder / "sched_rt_period_us")
    name = "real-time throttling"
    try:
        allowed_us, of_us = int(runtime or ""), int(period or "")
    except ValueError:
        return Line(
            name, "ok", f"not told here: taken for the kernel's default, {early.DEFAULT_SHARE:g} of a core"
        )
    if allowed_us < 0:
        return Line(name, "ok", "off")
    if of_us > 0 and allowed_us / of_us >= 0.5:  # the kernel's default is 950000 of 1000000
        return Line(name, "ok", f"{allowed_us} of {of_us} us: the loop stays far below")
    fix = "sudo sysctl -w kernel.sched_rt_runtime_us=950000"
    return Line(name, "warn", f"real-time processes get {allowed_us} of {of_us} us only", fix)


def late_ticks(root: Path) -> Line:
    """Who tells why a tick was late."""
    name = "causes of late ticks"
    if os.access(root / EVENTS / "sched/sched_switch/id", os.R_OK):
        # root looks; the unit's user may neither open tracefs nor ask perf_event_open(2)
        told = "told by the scheduler (tracefs) to who runs as this user, to an installed service by counters"
        return Line(name, "ok", told)
    if os.access(root / EVENTS.parent, os.R_OK):
        fix = "sudo mount -t tracefs nodev /sys/kernel/tracing"
        return Line(name, "warn", "by counters alone, half of them unknown: tracefs is not mounted", fix)
    # ok: causes are told all the same, if not all of them
    return Line(name, "ok", "by counters; the scheduler tells root (tracefs)")


def early_look(root: Path, asked: float | str, rate_hz: float, cores: int) -> Line:
    """How long the loop would look at the clock before each deadline, and what of its core that takes."""
    early_ns = np.zeros(early.PLACES, np.int64)
    share = early.realtime_share(root / "proc/sys/kernel")
    # as a loop with the rights would choose; whether there are any is told by machine_rights
    chosen = early.choose(early_ns, asked, 1 / rate_hz, cores, granted=True, share=share)
    return Line("early look", "ok", chosen.detail)


def _span(cores: set[int]) -> str:
    return ", ".join(map(str, sorted(cores)))
