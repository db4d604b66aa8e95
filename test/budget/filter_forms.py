#!/usr/bin/env python3
"""The covariance form of the filter against its square-root form, in float64 and float32: what each costs.

    build/venv/bin/python test/budget/filter_forms.py [--build build/arm64-flight] [--images N] RECORDING

Instructions of an image on 64-bit ARM, in millions, of all that the filter does to its covariance in each form, counted
as by instruction_budget.py. Time on this machine, accuracy and definiteness are told by plumb-filter-forms.
"""

import argparse
import sys
from pathlib import Path

import numpy as np
from instruction_budget import ROOT, images_of, trace_of


def main() -> int:
    """Counts and prints the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recording", type=Path)
    parser.add_argument("--build", type=Path, default=ROOT / "build/arm64-flight")
    parser.add_argument("--images", type=int, default=120, help="of the recording (default: %(default)s)")
    arguments = parser.parse_args()
    command = ["plumb-filter-forms", "--count", "--images", str(arguments.images), str(arguments.recording)]
    out, trace, _ = trace_of(arguments.build, command)
    forms = out.splitlines()
    costs = np.array([list(image.values()) for image in images_of(trace, dict(enumerate(forms)))]) / 1e6
    print(f"{len(costs)} images\n\n| form | mean | largest | of flown |\n|---|---:|---:|---:|")
    for form, cost in zip(forms, costs.T, strict=True):
        print(f"| {form} | {cost.mean():.2f} | {cost.max():.2f} | {cost.mean() / costs[:, 0].mean():.2f} |")
    return 0


if __name__ == "__main__":
    sys.exit(main())
