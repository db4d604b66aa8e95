#!/usr/bin/env python3
"""A recording flown through light that changes at once: error with and without tracker.light_change.

    build/venv/bin/python test/budget/light_change.py [--build build/flight] RECORDING

The images of the recording are made darker or brighter in turn, as clouds, shadows and automatic exposure do.
"""

import argparse
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
from plumb_tools.report.headline import headline_of
from plumb_tools.trajectory import read_truth
from tracker_comparison import fly

ROOT = Path(__file__).parents[2]
Light = Callable[[int], tuple[float, float]]
# Gain and offset [grey levels] of the n-th image.
LIGHTS: dict[str, Light] = {
    "as recorded": lambda n: (1.0, 0.0),
    "every other ten images at 0.6": lambda n: (0.6 if n // 10 % 2 else 1.0, 0.0),
    "every other image at 0.7": lambda n: (0.7 if n % 2 else 1.0, 0.0),
    "at 0.8, every other ten brighter by 40": lambda n: (0.8, 40.0 if n // 10 % 2 else 0.0),
}


def in_light(recording: Path, light: Light, out: Path) -> Path:
    """The recording in ASL format with other images; all else are links."""
    images = sorted((recording / "mav0/cam0/data").glob("*.png"))
    for path in recording.rglob("*"):
        copy = out / path.relative_to(recording)
        if path.is_dir():
            copy.mkdir(parents=True, exist_ok=True)
        elif path.suffix != ".png":
            copy.parent.mkdir(parents=True, exist_ok=True)
            copy.symlink_to(path.resolve())
    for n, path in enumerate(images):
        gain, offset = light(n)
        grey = gain * cv2.imread(str(path), cv2.IMREAD_GRAYSCALE).astype(np.float64) + offset
        cv2.imwrite(str(out / path.relative_to(recording)), np.clip(np.rint(grey), 0, 255).astype(np.uint8))
    return out


def main() -> int:
    """Flies the recording in every light and prints the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recording", type=Path, metavar="RECORDING")
    parser.add_argument("--build", type=Path, default=ROOT / "build/flight", help="default: %(default)s")
    arguments = parser.parse_args()
    replay = arguments.build / "bin/plumb-replay"
    truth = read_truth(arguments.recording)
    print("| light | ATE [mm] (resets) | with tracker.light_change=0 |\n|---|---:|---:|")
    for name, light in LIGHTS.items():
        with tempfile.TemporaryDirectory() as folder:
            copy = in_light(arguments.recording, light, Path(folder) / "recording")
            cells = []
            for light_change in (1, 0):
                parameters = f"tracker:\n  light_change: {light_change}\n"
                headline, _ = headline_of(truth, fly(replay, copy, Path(folder) / "out", parameters))
                cells.append(f"{1e3 * headline.ate_m:.1f} ({headline.resets})")
        print(f"| {name} | {' | '.join(cells)} |", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
