#!/usr/bin/env bash
# Runs a program in a network namespace whose loopback carries LCM's multicast group; exits with 1 where the system does
# not allow such a namespace.
set -euo pipefail

network='ip link set lo up && ip link set lo multicast on && ip route add 224.0.0.0/4 dev lo'
# Who may make one keeps his rights, among them those to real-time priority and to locked memory.
unshare=(unshare --net)
if ! "${unshare[@]}" sh -c "$network" 2>/dev/null; then
  unshare+=(--map-root-user)
  "${unshare[@]}" sh -c "$network" 2>/dev/null || {
    echo "no network namespace with a loopback can be made here: unshare --net and ip (iproute2) must work" >&2
    exit 1
  }
fi
export PLUMB_TEST_LCM_URL='udpm://239.255.76.67:7667?ttl=0'
exec "${unshare[@]}" sh -c "$network && exec \"\$@\"" sh "$@"
