#!/usr/bin/env bash
# in_systemd.sh SCRIPT [ARGUMENTS] - run SCRIPT as root under a real systemd (PID 1 of a container) and return its
# exit status. The container's root is a throw-away overlay over this machine's own; its output is printed. BIND_RO names
# what is there besides, as FOLDER:PLACE each.
# Needs: systemd, systemd-container, dbus (Debian packages), and root.
set -euo pipefail
script=$(realpath "$1"); shift
work=$(mktemp -d); root=$(mktemp -d); name=rtctl-test-$$
mkdir "$work/upper" "$work/work" "$work/exchange"
cp "$script" "$work/exchange/script"
printf '%q ' "$@" >"$work/exchange/arguments"
cat >"$work/exchange/run" <<'RUN'
#!/bin/bash
exec </dev/null >/exchange/output 2>&1
eval "bash /exchange/script $(cat /exchange/arguments)"
code=$?
echo $code >/exchange/code
exec systemctl exit -ff $code
RUN
chmod +x "$work/exchange/run"
cat >"$work/exchange/rtctl-test.service" <<'UNIT'
[Unit]
After=basic.target
[Service]
ExecStart=/exchange/run
UNIT
cat >"$work/exchange/rtctl-test.target" <<'UNIT'
[Unit]
Requires=basic.target
Wants=rtctl-test.service
After=basic.target
AllowIsolate=yes
UNIT

# nspawn wants a control group of its own; here it gets a child of ours, removed afterwards
groups=()
for tree in /sys/fs/cgroup/unified /sys/fs/cgroup/systemd; do
  [ -d "$tree" ] && { mkdir -p "$tree/$name"; echo $$ >"$tree/$name/cgroup.procs"; groups+=("$tree"); }
done
finish() {
  for tree in "${groups[@]}"; do
    echo $$ >"$tree/cgroup.procs"
    find "$tree/$name" -depth -type d -exec rmdir {} + 2>/dev/null || true
  done
  umount "$root" 2>/dev/null || true
  rm -rf "$work" "$root"
}
trap finish EXIT
mount --bind / "$root"

SYSTEMD_NSPAWN_UNIFIED_HIERARCHY=1 timeout -k 5 "${LIMIT_S:-600}" systemd-nspawn --quiet --directory="$root" --boot \
  --volatile=overlay --register=no --keep-unit --machine="$name" --console=pipe --link-journal=no --private-network \
  --capability=all --system-call-filter="bpf @memlock" \
  --bind="$work/exchange":/exchange $(printf -- '--bind-ro=%s ' ${BIND_RO:-}) \
  --bind-ro="$work/exchange/rtctl-test.service":/etc/systemd/system/rtctl-test.service \
  --bind-ro="$work/exchange/rtctl-test.target":/etc/systemd/system/rtctl-test.target \
  systemd.unit=rtctl-test.target systemd.show_status=0 </dev/null >"$work/console" 2>&1 || true
cat "$work/exchange/output" 2>/dev/null || true
if [ ! -s "$work/exchange/code" ]; then
  echo "the container ended without an answer:" >&2
  tail -20 "$work/console" >&2
  exit 125
fi
exit "$(cat "$work/exchange/code")"
