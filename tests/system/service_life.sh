#!/usr/bin/env bash
# The life of a rig as a service, under a real systemd: install, notify, deaths, three strikes, uninstall.
# Arguments: folder with the sources, folder with the virtual environment, folder with machine code that is compiled
# already, the Python that did it, and on a machine that is slow and whole (the emulated one; a container grants no
# real-time rights) how much more patience it takes. Prints one line per fact.
set -uo pipefail
sources=$1 venv=$2 compiled=$3 python=$(readlink -f "$4") slow=${5:-1} unit=rtctl@mock.service failed=0
fact() { local text=$1; shift; if "$@"; then echo "ok   $text"; else echo "FAIL $text"; failed=1; fi; }
show() { systemctl show -P "$1" "$unit"; }
is() { [ "$(show "$1")" = "$2" ] || { echo "     $1 is $(show "$1")"; return 1; }; }
wait_for() { for _ in $(seq $((${3:-600} * slow))); do [ "$(show "$1")" = "$2" ] && return 0; sleep 0.1; done; is "$1" "$2"; }
soon() { for _ in $(seq $((300 * slow))); do "$@" >/dev/null 2>&1 && return 0; sleep 0.2; done; "$@"; }
loop_pid() { pgrep -P "$(show MainPID)" -f rtctl.rt; }
journal() { journalctl -o cat -u "$unit" | grep -- "$1" >/dev/null; }  # -q would end before journalctl has
ask() { sudo_as "$python" -c "
import json, sys
from rtctl.client import RigClient
with RigClient('mock', runtime_dir='/run/rtctl', timeout_s=60) as rig:
    print(json.dumps(rig.status()))"; }
sudo_as() { setpriv --reuid=rtctl --regid=rtctl --init-groups env PYTHONPATH="$path" LD_LIBRARY_PATH="$library" "$@"; }

answered() { ask | grep -q '"state": "IDLE"' || { ask; return 1; }; }
in_state() { show StatusText | grep -q "$1" || { echo "     $(show StatusText)"; return 1; }; }

mkdir -p /opt/rtctl
cp -a "$sources"/rtctl "$sources"/hw "$sources"/configs "$sources"/systemd /opt/rtctl/
# the Python with the environment's packages: the environment's own may live where a service cannot look
packages=$(echo "$venv"/lib/"$(basename "$python")"/site-packages)
path=/opt/rtctl:$packages
library=$(dirname "$(dirname "$python")")/lib  # its own libpython, which it may look for where a service cannot
printf '#!/bin/sh\nLD_LIBRARY_PATH=%s PYTHONPATH=%s PYTHONDONTWRITEBYTECODE=1 exec %s -m rtctl "$@"\n' \
  "$library" "$path" "$python" >/usr/bin/rtctl
chmod 755 /usr/bin/rtctl
if [ "$slow" != 1 ]; then  # the times that an emulated processor cannot keep, and nothing else
  mkdir -p /run/systemd/system/rtctl@.service.d
  printf '[Unit]\nStartLimitIntervalSec=1800\n[Service]\nTimeoutStopSec=120\nWatchdogSec=20\nTimeoutStartSec=900\nEnvironment=NUMBA_CPU_NAME=generic NUMBA_CPU_FEATURES=\n' \
    >/run/systemd/system/rtctl@.service.d/slow.conf
  find /opt/rtctl -exec touch -h -d @1600000000 {} +  # as they were when the law was compiled
  systemctl set-environment NUMBA_CPU_NAME=generic NUMBA_CPU_FEATURES=  # for who compiles before the service starts, too
fi
mkdir -p /var/cache/rtctl; cp -a "$compiled" /var/cache/rtctl/compiled

rtctl service install /opt/rtctl/configs/mock.toml --command /usr/bin/rtctl || { echo "FAIL install"; journalctl -o cat -u "$unit" | tail -20; exit 1; }
fact "installed, started and ready" is ActiveState active
fact "its first start found its code compiled" sh -c "! journalctl -o cat -u $unit | grep 'compiling for this machine'"
fact "runs as its own user" [ "$(stat -c %U "/proc/$(show MainPID)")" = rtctl ]
fact "the unit is enabled" systemctl is-enabled --quiet "$unit"
fact "its sandbox is in force" [ "$(show PrivateTmp)$(show NoNewPrivileges)$(show ProtectSystem)" = yesyesstrict ]
if [ "$slow" != 1 ]; then
  fact "the loop has real-time priority, granted to its user" sh -c "chrt -p $(loop_pid) | grep -q SCHED_FIFO"
  fact "no right was refused" sh -c "! journalctl -o cat -u $unit | grep REFUSED"
  fact "its memory is locked" [ "$(awk '/VmLck/ {print $2}' "/proc/$(loop_pid)/status")" -gt 10000 ]
fi
rtctl service install /opt/rtctl/configs/mock.toml --command /usr/bin/rtctl | grep -q '^write' && again=1 || again=0
fact "installing again writes nothing" [ $again = 0 ]
fact "systemctl status shows the rig's state" soon in_state IDLE
fact "a client of its user is answered, and the rig is unarmed" answered

systemctl reload "$unit"
fact "a reload without changes is said in the journal" soon journal 'reload: nothing has changed'

[ "$slow" = 1 ] && kills="KILL SEGV" || kills=KILL  # minutes each where the processor is emulated
for kill in $kills; do
  restarts=$(show NRestarts)
  kill -$kill "$(loop_pid)"
  wait_for NRestarts $((restarts + 1)) 300; wait_for ActiveState active; sleep 1
  fact "SIG$kill of the loop: the host ended, the service came back" [ "$(show NRestarts)" -gt "$restarts" ]
  fact "SIG$kill of the loop: unarmed after the restart" soon in_state IDLE
  systemctl reset-failed "$unit"; sleep 1
done
fact "the journal says what happened" soon journal 'loop process died'
journal_errors() { journalctl -o cat -p err -u "$unit" | grep 'loop process died' >/dev/null; }
fact "the journal knows that for an error" soon journal_errors
fact "the safe stop ran through a device opened anew" soon journal 'nothing to stop'

if [ "$slow" = 1 ]; then
  restarts=$(show NRestarts); kill -STOP "$(loop_pid)"
  wait_for NRestarts $((restarts + 1)) 300; wait_for ActiveState active
  fact "a loop that stands still ends the service, and it comes back" [ "$(show NRestarts)" -gt "$restarts" ]
  systemctl reset-failed "$unit"
fi

restarts=$(show NRestarts); kill -STOP "$(show MainPID)"
wait_for NRestarts $((restarts + 1)) 300; wait_for ActiveState active
fact "a host that stands still is killed by the watchdog, and the service comes back" soon journal 'Watchdog timeout'
fact "the journal says that the run before was cut off" soon journal 'the run before was cut off'
systemctl reset-failed "$unit"

if [ "$slow" = 1 ]; then
  for strike in 1 2 3 4; do
    [ "$(show ActiveState)" = failed ] && break
    kill -KILL "$(loop_pid)"; sleep 0.3
    for _ in $(seq $((300 * slow))); do case "$(show ActiveState)" in active) [ "$(loop_pid)" ] && break ;; failed) break ;; esac; sleep 0.1; done
  done
  fact "after three deaths within a minute it stays down" is ActiveState failed
  sleep 3
  fact "and does not come back by itself" is ActiveState failed
  systemctl reset-failed "$unit"

  sed -i 's/rate_hz = 1000.0/rate_hz = -1.0/' /etc/rtctl/mock.toml
  systemctl start "$unit"; wait_for ActiveState failed 300
  fact "a wrong rig file is refused, once" is NRestarts 0
  fact "with the key in the journal" soon journal 'loop.rate_hz'
  fact "and in its status" in_state 'loop.rate_hz'
  systemctl reset-failed "$unit"
  sed -i 's/rate_hz = -1.0/rate_hz = 1000.0/' /etc/rtctl/mock.toml
  systemctl start "$unit"
  fact "and it starts again once the file is right" is ActiveState active
fi
began=$(date +%s%N); systemctl stop "$unit"; ended=$(date +%s%N)
fact "a stop ends it cleanly" is Result success
echo "     stopped in $(((ended - began) / 1000000)) ms"

rtctl service uninstall mock --purge
left=$(find /etc/rtctl /etc/systemd/system /etc/sysusers.d /etc/udev/rules.d /var/cache/rtctl /var/lib/rtctl /run/rtctl -iname '*rtctl*' ! -name 'rtctl-test*' 2>/dev/null)
fact "uninstall leaves nothing" [ -z "$left" ]; [ -z "$left" ] || echo "     $left"
[ $failed = 0 ] || { echo "--- journal"; journalctl -o cat -u "$unit" | tail -60; }
exit $failed
