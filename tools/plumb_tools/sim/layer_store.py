"""Texture layers are the same for every flight and slow to make: they are kept below build/."""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from importlib.metadata import version
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from plumb_tools.sim.digest import digest, sources_digest

Layer = npt.NDArray[np.uint8]

FOLDER = Path(__file__).resolve().parents[3] / "build" / "textures"

#: A layer follows from these alone.
_SOURCES = ("noise.py", "streams.py", "textures.py")
_LIBRARIES = ("numpy", "opencv-python-headless", "scikit-image", "scipy")


@cache
def _origin() -> str:
    here = Path(__file__).resolve().parent
    libraries = " ".join(version(name) for name in _LIBRARIES)
    return digest(sources_digest([here / name for name in _SOURCES]).encode(), libraries.encode())


def kept(name: str, make: Callable[[], Layer], folder: Path) -> Layer:
    """The layer of a name, from the folder when programs and libraries are those that made it."""
    path = folder / f"{name}-{_origin()}.png"
    with suppress(OSError, cv2.error):
        layer = cv2.imdecode(np.fromfile(path, np.uint8), cv2.IMREAD_GRAYSCALE)
        if layer is not None:
            return np.asarray(layer, np.uint8)
    layer = make()
    with suppress(OSError):  # the flight does without; it will say itself that the disk is full
        _keep(path, layer)
        for older in set(folder.glob(f"{name}-*.png")) - {path}:
            older.unlink(missing_ok=True)
    return layer


def _keep(path: Path, layer: Layer) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_suffix(f".{os.getpid()}")
    try:
        partial.write_bytes(cv2.imencode(".png", layer)[1].tobytes())
        os.replace(partial, path)
    finally:
        partial.unlink(missing_ok=True)
