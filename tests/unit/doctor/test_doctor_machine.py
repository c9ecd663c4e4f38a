"""Kernel, processor and rights, read from made-up trees."""

import gzip
from pathlib import Path

import pytest

from rtctl.host import machine_kernel as machine
from rtctl.host import machine_rights
from rtctl.rt.core import Choice

DYNAMIC = "Linux version 6.1.0 (x) #1 SMP PREEMPT_DYNAMIC Debian"


def put(root, path, content):
    target = root / path
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text(content + "\n")
    return root


@pytest.mark.parametrize(
    ("version", "command_line", "chosen", "status", "words"),
    [
        ("Linux version 6.1.0-rt #1 SMP PREEMPT_RT Debian", "", None, "ok", "PREEMPT_RT"),
        (DYNAMIC, "quiet preempt=full", None, "ok", "full"),
        (DYNAMIC, "quiet", "none voluntary (full)", "ok", "full"),
        (DYNAMIC, "quiet preempt=full", "none (voluntary) full", "warn", "voluntary"),
        (DYNAMIC, "quiet", None, "warn", "not readable"),
        ("Linux version 6.1.0 #1 SMP PREEMPT Debian", "", None, "ok", "full preemption"),
        ("Linux version 6.1.0 #1 SMP Debian", "", None, "warn", "no kernel preemption"),
    ],
)
def test_the_preemption_model_is_told_from_version_boot_and_debug_files(
    tmp_path, version, command_line, chosen, status, words
):
    put(tmp_path, "proc/version", version)
    put(tmp_path, "proc/cmdline", command_line)
    if chosen:
        put(tmp_path, "sys/kernel/debug/sched/preempt", chosen)
    line = machine.preemption(tmp_path)
    assert line.status == status
    assert words in line.found
    assert bool(line.fix) == (status != "ok")


@pytest.mark.parametrize(
    ("built", "status", "words"),
    [
        ("NONE", "warn", "none"),
        ("VOLUNTARY", "warn", "voluntary"),
        ("LAZY", "warn", "lazy"),
        ("", "ok", "full"),
    ],
)
@pytest.mark.parametrize("packed", [False, True])
def test_a_kernel_that_nobody_asked_has_the_model_it_was_built_with(tmp_path, built, status, words, packed):
    put(tmp_path, "proc/version", DYNAMIC)
    put(tmp_path, "proc/sys/kernel/osrelease", "6.1.0")
    config = f"CONFIG_PREEMPT_BUILD=y\nCONFIG_PREEMPT{'_' * bool(built)}{built}=y\nCONFIG_PREEMPT_DYNAMIC=y"
    if packed:
        (tmp_path / "proc/config.gz").write_bytes(gzip.compress(config.encode()))
    else:
        put(tmp_path, "boot/config-6.1.0", config)
    line = machine.preemption(tmp_path)
    assert (line.status, words in line.found) == (status, True)


def test_the_real_time_flag_of_the_kernel_decides(tmp_path):
    put(tmp_path, "proc/version", "Linux version 6.1.0 #1 SMP")
    put(tmp_path, "sys/kernel/realtime", "1")
    assert machine.preemption(tmp_path).status == "ok"


@pytest.mark.parametrize(
    ("source", "status"), [("tsc", "ok"), ("arch_sys_counter", "ok"), ("hpet", "warn"), ("acpi_pm", "warn")]
)
def test_a_slow_clock_source_is_a_warning(tmp_path, source, status):
    put(tmp_path, "sys/devices/system/clocksource/clocksource0/current_clocksource", source)
    assert machine.clock_source(tmp_path).status == status


CPU = "sys/devices/system/cpu/"


def test_the_governor_is_that_of_the_loops_core(tmp_path):
    put(tmp_path, CPU + "cpu0/cpufreq/scaling_governor", "performance")
    put(tmp_path, CPU + "cpu3/cpufreq/scaling_governor", "powersave")
    assert machine.governor(tmp_path, 0).status == "ok"
    assert machine.governor(tmp_path, 1).status == "ok", "no frequency scaling there"
    line = machine.governor(tmp_path, 3)
    assert line.status == "warn"
    assert "cpupower -c 3" in line.fix


@pytest.mark.parametrize(
    ("isolated", "status"), [("2-3", "ok"), ("1,3", "ok"), ("", "warn"), ("0-2", "warn")]
)
def test_the_loops_core_is_looked_up_in_the_isolated_ones(tmp_path, isolated, status):
    put(tmp_path, CPU + "isolated", isolated)
    line = machine.isolation(tmp_path, 3)
    assert line.status == status
    if status == "warn":
        assert "isolcpus=3" in line.fix
        assert "irqaffinity=0" in line.fix
        assert "loop.cpu = 3" in line.fix


def test_devices_are_not_sent_to_the_loops_own_core(tmp_path):
    assert "irqaffinity=1" in machine.isolation(tmp_path, 0).fix


def interrupts(root):
    for number, devices, counts in ((24, "ACPI:Ged", "1,0"), (36, "virtio1-req.0", "7,1891772"),
                                    (41, "eth0,eth1", "19811,199")):  # fmt: skip
        put(root, f"sys/kernel/irq/{number}/actions", devices)
        put(root, f"sys/kernel/irq/{number}/per_cpu_count", counts)


def test_devices_that_interrupt_the_loops_core_are_named_with_the_way_to_move_them(tmp_path):
    interrupts(tmp_path)
    line = machine.device_interrupts(tmp_path, 1, 200.0)
    assert (line.status, line.found) == ("warn", "core 1 serves virtio1-req.0")
    assert "echo 0 | sudo tee /proc/irq/36/smp_affinity_list " in line.fix
    assert machine.device_interrupts(tmp_path, 0, 200.0).found == "core 0 serves eth0,eth1", "99 a second"
    assert machine.device_interrupts(tmp_path, 1, 2e6).status == "ok"


def test_what_is_not_told_of_interrupts_is_no_warning(tmp_path):
    assert machine.device_interrupts(tmp_path, 1).found == "not told here"
    interrupts(tmp_path)
    assert machine.device_interrupts(tmp_path, 9).found == "not told here", "a core that is not there"


def test_a_core_that_is_switched_off_fails(tmp_path):
    put(tmp_path, CPU + "online", "0-1,4")
    assert machine.core_present(tmp_path, Choice(4, "the last one")).found == "core 4: the last one"
    line = machine.core_present(tmp_path, Choice(2, "loop.cpu"))
    assert line.status == "fail"
    assert "0, 1, 4" in line.found


def test_late_ticks_are_told_by_the_scheduler_where_tracefs_is_mounted(tmp_path):
    assert machine.late_ticks(tmp_path).found == "by counters; the scheduler tells root (tracefs)"
    (tmp_path / "sys/kernel/tracing").mkdir(parents=True)
    assert machine.late_ticks(tmp_path).fix == "sudo mount -t tracefs nodev /sys/kernel/tracing"
    put(tmp_path, "sys/kernel/tracing/events/sched/sched_switch/id", "372\n")
    told = "told by the scheduler (tracefs) to who runs as this user, to an installed service by counters"
    assert machine.late_ticks(tmp_path) == machine.Line("causes of late ticks", "ok", told)


def test_idle_states_need_the_latency_device(tmp_path, monkeypatch):
    assert machine.idle_states(tmp_path).status == "warn"
    put(tmp_path, "dev/cpu_dma_latency", "")
    assert machine.idle_states(tmp_path).status == "ok"
    monkeypatch.setattr("os.access", lambda *_: False)
    line = machine.idle_states(tmp_path)
    assert line.status == "warn"
    assert 'KERNEL=="cpu_dma_latency"' in line.fix


@pytest.mark.parametrize(
    ("runtime", "status"), [("950000", "ok"), ("-1", "ok"), ("100000", "warn"), ("0", "warn")]
)
def test_throttling_of_real_time_processes(tmp_path, runtime, status):
    put(tmp_path, "proc/sys/kernel/sched_rt_runtime_us", runtime)
    put(tmp_path, "proc/sys/kernel/sched_rt_period_us", "1000000")
    assert machine.throttling(tmp_path).status == status


@pytest.mark.parametrize("content", ["", "nonsense", "\x00\xff", "-", "3-", "9" * 400])
def test_no_file_whatever_it_holds_raises(tmp_path, content):
    for path in (
        "proc/version", "proc/cmdline", "proc/self/limits", "proc/self/status", CPU + "isolated",
        CPU + "online",
        "proc/sys/kernel/sched_rt_runtime_us", "proc/sys/kernel/sched_rt_period_us",
        "sys/kernel/debug/sched/preempt",
        "etc/systemd/system/rtctl@.service",
    ):  # fmt: skip
        put(tmp_path, path, content)
    machine.check(tmp_path, Choice(1, "loop.cpu"))
    machine_rights.check(tmp_path, "mock", 80)


def test_an_empty_tree_raises_nothing(tmp_path):
    assert len(machine.check(tmp_path, Choice(0, "loop.cpu"))) == 9
    assert machine_rights.check(tmp_path, "", 80)


LIMITS = """Limit                     Soft Limit           Hard Limit           Units
Max locked memory         {memlock}              8388608              bytes
Max realtime priority     {rtprio}                    99                   """


def shell(root, rtprio, memlock, capabilities="0000000000000000"):
    put(root, "proc/self/limits", LIMITS.format(rtprio=rtprio, memlock=memlock))
    put(root, "proc/self/status", f"Name:\tx\nCapEff:\t{capabilities}")
    return [line.status for line in machine_rights.shell(root, 80)]


def test_the_shells_limits_count_or_the_capabilities(tmp_path):
    assert shell(tmp_path, 0, 8388608) == ["warn", "warn"]
    assert shell(tmp_path, 80, "unlimited") == ["ok", "ok"]
    assert shell(tmp_path, 79, "unlimited") == ["warn", "ok"]
    assert shell(tmp_path, 0, 0, f"{1 << 23 | 1 << 14:016x}") == ["ok", "ok"]
    fixes = [line.fix for line in machine_rights.shell(tmp_path, 80) if line.fix]
    assert not fixes


UNIT = "[Unit]\nLimitRTPRIO=1\n[Service]\nLimitRTPRIO={rtprio}\nLimitMEMLOCK={memlock}\n"


def service(root, rig="mock"):
    return {line.check: line for line in machine_rights.service(root, rig, 80)}


def test_a_unit_that_is_not_installed_is_told_with_the_command(tmp_path):
    line = service(tmp_path)["service unit"]
    assert line.status == "warn"
    assert line.fix == "sudo rtctl service install RIG.toml"


@pytest.mark.parametrize(
    ("rtprio", "memlock", "statuses"),
    [
        ("80", "infinity", ("ok", "ok")),
        ("99", "1G", ("ok", "ok")),
        ("70", "infinity", ("fail", "ok")),
        ("80:99", "64M", ("ok", "fail")),
        ("80", "65536", ("ok", "fail")),
    ],
)
def test_the_units_limits_are_compared_with_what_the_loop_asks(tmp_path, rtprio, memlock, statuses):
    put(tmp_path, "usr/lib/systemd/system/rtctl@.service", UNIT.format(rtprio=rtprio, memlock=memlock))
    found = service(tmp_path)
    assert (found["service rtprio"].status, found["service memlock"].status) == statuses
    assert found["service unit"].found == "/usr/lib/systemd/system/rtctl@.service"


def test_drop_ins_are_applied_and_those_of_other_rigs_are_not(tmp_path):
    put(tmp_path, "usr/lib/systemd/system/rtctl@.service", UNIT.format(rtprio="10", memlock="infinity"))
    put(tmp_path, "etc/systemd/system/rtctl@mock.service.d/rt.conf", "[Service]\nLimitRTPRIO=85")
    put(tmp_path, "etc/systemd/system/rtctl@other.service.d/zz.conf", "[Service]\nLimitRTPRIO=1")
    assert service(tmp_path)["service rtprio"].status == "ok"
    assert service(tmp_path, "third")["service rtprio"].status == "fail"
    put(tmp_path, "etc/systemd/system/rtctl@.service.d/zz.conf", "[Service]\n#LimitRTPRIO=99\nLimitRTPRIO=2")
    assert service(tmp_path)["service rtprio"].status == "fail"


def test_the_unit_we_ship_grants_what_the_default_priority_asks(tmp_path):
    ours = Path(__file__).parents[3] / "systemd" / machine_rights.UNIT
    put(tmp_path, f"etc/systemd/system/{machine_rights.UNIT}", ours.read_text())
    assert {line.status for line in machine_rights.service(tmp_path, "mock", 80)} == {"ok"}


@pytest.mark.parametrize(("uid", "said"), [("0", 1), ("1000", 0)])
def test_root_is_told_to_work_as_an_ordinary_user(tmp_path, uid, said):
    put(tmp_path, "proc/self/status", f"Name:\trtctl\nUid:\t1000\t{uid}\t1000\t1000")
    lines = list(machine_rights.user(tmp_path, "sudo rtctl service install a.toml"))
    assert len(lines) == said
    for line in lines:
        assert line.status == "warn"
        assert "group dialout" in line.fix
        assert "sudo rtctl service install a.toml" in line.fix


def test_missing_rights_name_the_command_that_gives_them_all(tmp_path):
    install = "sudo /opt/rtctl/bin/python -m rtctl service install rig.toml"
    lines = machine_rights.check(tmp_path, "rig", 80, install)
    wrong = [line for line in lines if line.status != "ok"]
    assert {"shell rtprio", "shell memlock", "service unit"} <= {line.check for line in wrong}
    assert all(install in line.fix for line in wrong)
