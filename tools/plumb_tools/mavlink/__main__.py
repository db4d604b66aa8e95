"""Command line of the bridge."""

from __future__ import annotations

import argparse
import signal
import sys
import time
from collections.abc import Callable
from pathlib import Path

from plumb_tools.arguments import LCM_URL, number, positive_number, whole_number
from plumb_tools.mavlink import frames
from plumb_tools.mavlink.convert import Converter, Options
from plumb_tools.mavlink.link import Link, LinkLost
from plumb_tools.mavlink.source import Log, Network
from plumb_tools.trajectory import FloatArray, InputError

EXIT_LINK_LOST = 1
EXIT_BAD_INPUT = 2

HEARTBEAT_S = 1.0
STATUS_S = 10.0
TERMINAL_STATUS_S = 1.0

DESCRIPTION = """\
Hands Plumb's navigation state to an autopilot: ODOMETRY, DISTANCE_SENSOR and HEARTBEAT over MAVLink 2, as component
197 (visual-inertial odometry). Answers TIMESYNC with the flight clock, so run it on the computer that plumb-fsw runs
on. docs/autopilots.md says how PX4 and ArduPilot are set up for it."""

EXAMPLES = """\
examples:
  tools/mavlink_bridge --connect /dev/ttyS1 --baud 921600       a serial line to the autopilot
  tools/mavlink_bridge --connect udpout:192.168.1.10:14550      a network to it
  tools/mavlink_bridge --connect udpout:127.0.0.1:14550 --log flight.lcm     a recorded flight, on the bench
  tools/mavlink_bridge --connect /dev/ttyS1 --imu-axes FRD --imu-tilt 0 -2.5 0   an IMU as it is mounted

exit codes: 0 stopped or the log has ended, 1 the device is gone, 2 bad input"""


def _imu_axes(text: str) -> str:
    try:
        frames.body_from_imu(text)
    except ValueError:
        expected = "three of the letters F B R L U D that make a right-handed frame, such as FLU or FRD"
        raise argparse.ArgumentTypeError(f"{text!r}; expected {expected}") from None
    return text


def _parser() -> argparse.ArgumentParser:
    defaults = Options()
    parser = argparse.ArgumentParser(
        prog="mavlink_bridge",
        description=DESCRIPTION,
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = parser.add_argument
    add("--connect", metavar="WHERE", required=True, help="udpout:, udpin: or udpbcast:HOST:PORT, or a serial device")
    add("--baud", metavar="N", type=whole_number(1200), default=921600, help="of a serial device (default: 921600)")
    add("--system", metavar="N", type=whole_number(1, 255), default=1, help="MAVLink id of the vehicle (default: 1)")
    add(
        "--lcm",
        metavar="URL",
        default=LCM_URL,
        help="where plumb-fsw or plumb-replay publishes (default: %(default)s)",
    )
    add("--log", metavar="FILE", type=Path, help="play an LCM event log instead")
    add("--fast", action="store_true", help="with --log: as fast as possible instead of as it was recorded")
    add(
        "--rate",
        metavar="HZ",
        type=positive_number,
        default=defaults.rate_hz,
        help="of ODOMETRY (default: %(default)g; PX4 wants 30 to 50)",
    )
    add("--ned", action="store_true", help="say LOCAL_NED once the heading is known (not for ArduPilot)")
    add(
        "--imu-axes",
        metavar="AXES",
        type=_imu_axes,
        default="FLU",
        help="where the IMU's x, y and z point: F B R L U D (default: %(default)s)",
    )
    add(
        "--imu-tilt",
        metavar=("ROLL", "PITCH", "YAW"),
        nargs=3,
        type=number,
        default=(0.0, 0.0, 0.0),
        help="degrees by which it is turned from there, about the body's axes",
    )
    add(
        "--range-limits",
        metavar=("MIN", "MAX"),
        nargs=2,
        type=positive_number,
        default=defaults.range_limits_m,
        help="of the range finder, m (default: 0.1 40)",
    )
    add(
        "--range-orientation",
        metavar="N",
        type=whole_number(0, 40),
        default=defaults.range_orientation,
        help="MAV_SENSOR_ORIENTATION of the range finder (default: %(default)s, down)",
    )
    add("--range-noise", metavar="M", type=positive_number, default=0.0, help="its noise, 1 sigma (default: not told)")
    return parser


class Bridge:
    """What is done again and again beside the messages themselves."""

    def __init__(self, converter: Converter, link: Link) -> None:
        self._converter, self._link = converter, link
        self._is_terminal = sys.stderr.isatty()
        self._status_s = TERMINAL_STATUS_S if self._is_terminal else STATUS_S
        self._due_s: dict[Callable[[], None], float] = {self._beat: 0.0, self.tell: time.monotonic() + self._status_s}

    def run(self, source: Network | Log) -> None:
        """Until there are no more messages."""
        for message in source.messages((self._link.descriptor,)):
            self._link.receive()
            if message is not None:
                for made in self._converter.take(*message):
                    self._link.send(made)
            self._do_what_is_due()

    def _do_what_is_due(self) -> None:
        now_s = time.monotonic()
        for what, period_s in ((self._beat, HEARTBEAT_S), (self.tell, self._status_s)):
            if now_s >= self._due_s[what]:
                self._due_s[what] = now_s + period_s
                what()

    def _beat(self) -> None:
        self._link.send_heartbeat(self._converter.has_state)

    def tell(self) -> None:
        """One line of counts."""
        made = ", ".join(f"{count} {name}" for name, count in sorted(self._converter.counts.items())) or "nothing yet"
        heard = ", ".join(f"{count} {name}" for name, count in self._link.heard.most_common(3)) or "nothing"
        line = f"mavlink_bridge: {made}; heard {heard}"
        print(line, end="\r" if self._is_terminal else "\n", file=sys.stderr, flush=True)


def _imu(arguments: argparse.Namespace) -> FloatArray:
    return frames.body_from_imu(arguments.imu_axes, tuple(arguments.imu_tilt))


def _run(arguments: argparse.Namespace) -> None:
    low_m, high_m = arguments.range_limits
    if low_m >= high_m or high_m > 655.0:
        raise InputError(f"--range-limits {low_m:g} {high_m:g}: expected the smaller first, and at most 655 m")
    if arguments.fast and arguments.log is None:
        raise InputError("--fast is for a log: expected --log FILE")
    converter = Converter(
        Options(
            rate_hz=arguments.rate,
            r_BI=_imu(arguments),
            say_north=arguments.ned,
            range_limits_m=(low_m, high_m),
            range_orientation=arguments.range_orientation,
            range_noise_m=arguments.range_noise,
        )
    )
    source: Network | Log
    if arguments.log is not None:
        source = Log(arguments.log, converter.channels, arguments.fast)
    else:
        source = Network(arguments.lcm, converter.channels)
    link = Link(arguments.connect, arguments.baud, arguments.system, source.now_ns)
    bridge = Bridge(converter, link)
    try:
        bridge.run(source)
    finally:
        bridge.tell()
        print(file=sys.stderr)
        link.close()


def main(argv: list[str] | None = None) -> int:
    """Runs until it is stopped or the log has ended; returns the exit code."""
    arguments = _parser().parse_args(argv)
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        _run(arguments)
    except KeyboardInterrupt:
        return 0
    except (InputError, LinkLost) as error:
        print(f"mavlink_bridge: {error}", file=sys.stderr)
        return EXIT_LINK_LOST if isinstance(error, LinkLost) else EXIT_BAD_INPUT
    return 0


if __name__ == "__main__":
    sys.exit(main())
