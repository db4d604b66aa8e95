#!/bin/sh
# What tools/tests/test_target.py does with a package in the virtual flight computer. Where /host has them: small.lcm is a
# log to be flown again, played.lcm one to be played, and hil.yaml the configuration of who flies by that. Flights are
# flown in the machine's memory: waiting for the computer outside would take up time of the flight.
plumb=/opt/plumb
mkdir /tmp/flights
cd /tmp/flights

for program in $plumb/bin/*; do
  $program --help >help.txt
  echo "$program --help: $?" >>status.txt
done
$plumb/bin/plumb-fsw --dry-run $plumb/etc/flight.yaml >dry-run.txt 2>&1
echo "dry run: $?" >>status.txt

/programs/target_tests --gtest_filter='LiveTarget*'
echo "live flights: $?" >>status.txt

# The flight computer is up before the first byte comes, so that none is lost.
play() {
  cp /host/small.lcm /host/played.lcm /host/hil.yaml .
  $plumb/bin/plumb-replay --log small.lcm --out again >again.txt 2>&1
  echo "replay: $?" >>status.txt
  $plumb/bin/plumb-hil played.lcm --pty /tmp/imu --can vcan0 --video /dev/video9 --delay 4 >hil.txt 2>&1 &
  player=$!
  sleep 2
  $plumb/bin/plumb-fsw hil.yaml >hil-flight.txt 2>&1 &
  flight=$!
  wait $player
  echo "play: $?" >>status.txt
  sleep 1
  kill $flight
  wait $flight
  echo "flight by what is played: $?" >>status.txt
  cp -r again again.txt hil.txt hil-flight.txt hil.lcm /host/
}
[ ! -f /host/played.lcm ] || play
cp status.txt dry-run.txt flight.lcm flight.txt can.lcm can.txt /host/
