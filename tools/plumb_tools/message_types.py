"""The types of LCM messages, fsw/telemetry/*.lcm, made into Python by lcm-gen."""

from __future__ import annotations

import functools
import importlib
import subprocess
import sys
import tempfile
from pathlib import Path
from types import ModuleType

_FOLDER = Path(__file__).resolve().parents[2] / "fsw" / "telemetry"


def files() -> list[Path]:
    """What defines them."""
    return sorted(_FOLDER.glob("*.lcm"))


@functools.cache
def types() -> ModuleType:
    """The package of message types."""
    with tempfile.TemporaryDirectory() as folder:
        generate = "from lcm import run_gen; run_gen()"  # LCM's own, of the same version as its library
        subprocess.run([sys.executable, "-c", generate, "--python", "--ppath", folder, *files()], check=True)
        sys.path.insert(0, folder)
        try:
            return importlib.import_module("plumb")
        finally:
            sys.path.remove(folder)
