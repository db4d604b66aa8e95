"""Random streams of a flight: one per purpose, by name, so that one sensor's draws never shift another's."""

from __future__ import annotations

import zlib

import numpy as np

#: Streams in use. A name's number is its checksum, so that adding a name leaves the others as they are.
Generator = np.random.Generator


def stream(seed: int, name: str, index: int = 0) -> Generator:
    """The stream `name` of a seed; `index` tells apart many of one kind, such as the frames of a camera."""
    sequence = np.random.SeedSequence(entropy=seed, spawn_key=(zlib.crc32(name.encode()), index))
    return np.random.Generator(np.random.SFC64(sequence))
