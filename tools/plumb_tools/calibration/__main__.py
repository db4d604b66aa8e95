"""Command line of the importer."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from plumb_tools import files
from plumb_tools.calibration import kalibr, write
from plumb_tools.trajectory import InputError

EXIT_BAD_INPUT = 2

DESCRIPTION = """\
Makes Plumb's calibration files from those of another tool.

CAMCHAIN  Kalibr's camchain-imucam.yaml, or a file in its form with T_imu_cam, as OpenVINS has it
IMU       Kalibr's imu.yaml

Writes into FOLDER
  mav0/cam0/sensor.yaml, mav0/imu0/sensor.yaml   for a recording in the ASL layout
  calibration.yaml                               the sections imu and camera of a configuration of plumb-fsw
  mav0/cam0/data.csv                             with --images: the table of images, stamped by the IMU's clock"""

EXAMPLES = """\
examples:
  tools/import kalibr camchain-imucam.yaml imu.yaml --out flight
  tools/import kalibr camchain-imucam.yaml imu.yaml --camera cam1 --images recorded/data.csv --out flight

exit codes: 0 written, 2 bad input"""


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="import", description=DESCRIPTION, epilog=EXAMPLES, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("tool", choices=["kalibr"], help="whose files they are")
    parser.add_argument("camchain", metavar="CAMCHAIN", type=Path)
    parser.add_argument("imu", metavar="IMU", type=Path)
    parser.add_argument("--out", metavar="FOLDER", type=Path, required=True, help="where they go; none is written over")
    parser.add_argument("--camera", metavar="NAME", default="cam0", help="which of CAMCHAIN (default: %(default)s)")
    parser.add_argument("--images", metavar="CSV", type=Path, help="table of images to be stamped anew")
    return parser


def main(argv: list[str] | None = None) -> int:
    """Writes the files; returns the exit code."""
    arguments = _parser().parse_args(argv)
    try:
        files.expect_folder(arguments.out, "--out")
        camera = kalibr.read_camera(arguments.camchain, arguments.camera)
        imu = kalibr.read_imu(arguments.imu)
        source = f"{arguments.camchain.name} ({arguments.camera}) and {arguments.imu.name}"
        for path in write.write(arguments.out, camera, imu, source, arguments.images):
            print(path)
    except (InputError, OSError) as error:
        for line in files.told(error).splitlines():
            print(f"import: {line}", file=sys.stderr)
        return EXIT_BAD_INPUT
    if camera.shift_s != 0.0 and arguments.images is None:
        shift = f"images are to be stamped {camera.shift_s:+.6f} s later, to be on the IMU's clock"
        print(f"import: warning: {shift}; --images does that to a table of images", file=sys.stderr)
    return 0


if __name__ == "__main__":
    sys.exit(main())
