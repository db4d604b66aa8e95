#!/bin/bash
# Runs a program under a Linux kernel of its own that has what a host's kernel may not: SocketCAN with a virtual CAN
# interface, and character devices served by programs (CUSE).
#
#     in_user_mode_linux.sh [--seconds N] [--memory SIZE] PROGRAM [ARGUMENT...]
#
# --seconds: the program's longest time, 240; --memory: of the kernel with all its files, 512M.
# The kernel is Debian's user-mode-linux, an ordinary process; it sees the host's files, read-only, and nothing of its
# devices or network. Exits with the program's exit status, or with 1 and the name of what is missing where that kernel is
# not installed, the machine does not let it run, or it lacks a part.
# The program finds the interface vcan0 and /dev/cuse; PLUMB_TEST_KERNEL is set, and nothing of the environment outside:
# give it by `env NAME=VALUE PROGRAM`. There is one processor, and /tmp is in memory.
set -euo pipefail

if [[ $$ != 1 ]]; then
  seconds=240 memory=512M
  while [[ ${1-} == -* ]]; do
    case $1 in
      -h | --help) sed -n '/^# /s/^# \?//p;/^set/q' "$0" && exit 0 ;;
      --seconds) seconds=${2-} ;;
      --memory) memory=${2-} ;;
      *) echo "$1 is no option; expected --seconds, --memory or --help" && exit 2 ;;
    esac
    shift $(($# < 2 ? $# : 2))
  done
  [[ $seconds =~ ^[1-9][0-9]*$ ]] || { echo "--seconds $seconds: expected a whole number above 0" && exit 2; }
  [[ $memory =~ ^[1-9][0-9]*[MG]$ ]] || { echo "--memory $memory: expected a size such as 512M or 2G" && exit 2; }
  [[ $# != 0 ]] || { echo "no program; expected in_user_mode_linux.sh [OPTION...] PROGRAM [ARGUMENT...]" && exit 2; }
  for needed in linux.uml modprobe; do
    PATH=$PATH:/usr/sbin:/sbin command -v "$needed" >/dev/null || {
      echo "no $needed here, of the packages user-mode-linux and kmod; expected them installed: tools/setup --tests"
      exit 1
    }
  done
  script=$(realpath "$0")
  # The kernel's command line takes no blanks and little text, so the command goes by file.
  work=$(mktemp -d /tmp/plumb_uml_XXXXXX)
  trap 'rm -rf "$work"' EXIT
  { printf 'cd %q && ' "$PWD" && printf '%q ' "$@"; } >"$work/command"
  # Its memory is a file that it runs. On a disk the system would keep writing it there, and hold the kernel up.
  # Where there is no /dev/shm, or no room in it, the disk has to do.
  ram=$(mktemp -d /dev/shm/plumb_uml_XXXXXX 2>/dev/null) && trap 'rm -rf "$work" "$ram"' EXIT
  room=$(df --output=avail -B1 /dev/shm 2>/dev/null | tail -1)
  [[ -n $ram && ${room:-0} -gt $(numfmt --from=iec "$memory") ]] && cp /bin/true "$ram" && "$ram/true" || ram=$work
  TMPDIR=$ram timeout "$seconds" linux.uml mem="$memory" "umid=plumb$$" "uml_dir=$work/" rootfstype=hostfs rootflags=/ ro \
    "init=$script" "PLUMB_WORK=$work" con=null con0=fd:0,fd:1 quiet </dev/null >"$work/console" 2>&1 || true
  sed -e 's/\r$//' -e '/^exit status [0-9]*$/d' "$work/console"
  grep -q "^kernel " "$work/console" || { echo "no kernel in user mode (linux.uml) runs on this machine" && exit 1; }
  status=$(sed -n 's/^exit status \([0-9]*\)\r*$/\1/p' "$work/console")
  [[ -n $status ]] || echo "the program did not end within $seconds s (--seconds)"
  exit "${status:-1}"
fi

# From here on as the first process under that kernel.
export PATH=/usr/sbin:/usr/bin:/sbin:/bin PLUMB_TEST_KERNEL=1 PYTHONDONTWRITEBYTECODE=1
command=$(<"$PLUMB_WORK/command")
echo "kernel $(uname -r)"
mount -t proc proc /proc
mount -t sysfs sys /sys
mount -t tmpfs tmp /tmp
mount -t tmpfs run /run
mkdir -p /dev/pts && mount -t devpts -o ptmxmode=666 pts /dev/pts  # for pseudo-terminals
modules=/usr/lib/uml/modules/$(uname -r)/kernel
# By path and in order: modprobe looks where the host's modules are.
for module in drivers/net/can/dev/can-dev net/can/can net/can/can-raw drivers/net/can/vcan fs/fuse/fuse fs/fuse/cuse; do
  insmod "$modules/$module.ko" 2>/dev/null || true
done
ip link set lo up
status=0
lacks() {
  echo "the kernel $(uname -r) lacks $1; expected it built in, or as a module below $modules"
  status=1
}
grep -q '^CAN_RAW ' /proc/net/protocols || lacks "SocketCAN (modules can, can-raw)"
ip link add vcan0 type vcan && ip link set vcan0 up || lacks "virtual CAN interfaces (module vcan)"
[[ -e /dev/cuse ]] || lacks "character devices served by programs (modules fuse, cuse)"
[[ $status != 0 ]] || bash -c "$command" || status=$?
echo "exit status $status"
poweroff -f &>/dev/null
