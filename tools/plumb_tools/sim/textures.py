"""Makes the texture layers of `materials.py`: photographs from scikit-image, procedural ones, or the user's own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from plumb_tools.sim import layer_store, noise
from plumb_tools.sim.materials import INDEX, MATERIALS
from plumb_tools.sim.noise import Image
from plumb_tools.sim.streams import Generator, stream
from plumb_tools.trajectory import InputError

#: Edge of a layer [px]. At the fine scale 0.9 mm per texel.
SIZE_PX = 1024

#: Standard deviation of a layer around its mean of 0.5.
_CONTRAST = 0.17

PICTURES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp")

#: The world's look belongs to the world, not to the flight: the same for every seed.
_LOOK_SEED = 20210530

#: Strip in which the far edge of a photograph fades into the near one.
_FADE_PX = 128

#: Uneven brightness is so broad that it is looked for in a picture this much smaller.
_SHRINK = 8


def _photograph(name: str) -> Image:
    from skimage import data  # costs a second to load

    return _seamless(np.asarray(getattr(data, name)(), dtype=np.float32))


def _seamless(picture: npt.NDArray[np.floating]) -> Image:
    """A square, repeating layer from a photograph: brightness evened out, edges faded into one another."""
    edge = min(picture.shape)
    whole = SIZE_PX + _FADE_PX
    square = cv2.resize(picture[:edge, :edge].astype(np.float32), (whole, whole), interpolation=cv2.INTER_CUBIC)
    share = np.linspace(0.0, np.pi / 2.0, _FADE_PX, dtype=np.float32)
    rise, fall = np.sin(share), np.cos(share)  # squares add up to one: the contrast stays even
    small = cv2.resize(square, None, fx=1 / _SHRINK, fy=1 / _SHRINK, interpolation=cv2.INTER_AREA)
    uneven = cv2.GaussianBlur(small, (0, 0), small.shape[0] / 8.0)
    level = square - cv2.resize(uneven, (whole, whole), interpolation=cv2.INTER_CUBIC)
    level[:, :_FADE_PX] = level[:, :_FADE_PX] * rise + level[:, SIZE_PX:] * fall
    level[:_FADE_PX] = level[:_FADE_PX] * rise[:, None] + level[SIZE_PX:] * fall[:, None]
    return noise.standardised(level[:SIZE_PX, :SIZE_PX])


def _grain(random: Generator, strength: float) -> Image:
    """Fine grain that photographs enlarged to the layer's size lack."""
    return np.asarray(strength * noise.fractal(random, (SIZE_PX, SIZE_PX), 0.4, low=60.0))


def _blades(random: Generator) -> Image:
    return np.asarray(_photograph("grass") + _grain(random, 0.25), np.float32)


def _pebbles(random: Generator) -> Image:
    return np.asarray(_photograph("gravel") + _grain(random, 0.25), np.float32)


def _bricks(random: Generator) -> Image:
    return np.asarray(_photograph("brick") + _grain(random, 0.2), np.float32)


def _speckle(random: Generator) -> Image:
    shape = (SIZE_PX, SIZE_PX)
    fine = noise.fractal(random, shape, 0.7, low=8.0, high=400.0)
    grit = noise.blurred((random.random(shape) > 0.998).astype(np.float32), 1.6)
    dark = noise.blurred((random.random(shape) > 0.9985).astype(np.float32), 2.4)
    return noise.standardised(fine + 0.7 * noise.standardised(grit) - 0.9 * noise.standardised(dark))


def _clumps(random: Generator) -> Image:
    shape = (SIZE_PX, SIZE_PX)
    base = noise.fractal(random, shape, 1.0, low=2.0)
    tufts = np.maximum(noise.fractal(random, shape, 0.9, low=12.0, high=160.0) - 0.7, 0.0)
    return noise.standardised(base + 0.9 * noise.standardised(tufts) - 0.8 * noise.standardised(np.roll(tufts, 9)))


def _stains(random: Generator) -> Image:
    shape = (SIZE_PX, SIZE_PX)
    broad = noise.fractal(random, shape, 1.3, low=2.0)
    spots = np.tanh(4.0 * np.maximum(noise.fractal(random, shape, 1.4, low=8.0, high=90.0) - 1.1, 0.0))
    return noise.standardised(
        broad - 0.8 * noise.standardised(spots) + 0.25 * noise.fractal(random, shape, 0.5, low=40.0)
    )


def _cracks(random: Generator) -> Image:
    shape = (SIZE_PX, SIZE_PX)
    nearest, second, number = noise.cells(random, SIZE_PX, 60, warp_px=14.0)
    lines = np.exp(-(((second - nearest) / 3.0) ** 2)) * (noise.fractal(random, shape, 1.5, low=2.0) > -0.3)
    plates = random.standard_normal(60)[number]
    return noise.standardised(noise.fractal(random, shape, 0.9, low=3.0) + 0.35 * plates - 2.2 * lines)


def _tiles(random: Generator) -> Image:
    """Three by three roof tiles: barrel profile across, dark lower edge along."""
    y, x = np.mgrid[0:SIZE_PX, 0:SIZE_PX] / SIZE_PX * 3.0
    barrel = np.cos(2.0 * np.pi * x) * 0.9
    edge = -2.4 * np.exp(-((((y % 1.0) - 0.04) / 0.05) ** 2))
    shade = random.standard_normal((3, 3))[y.astype(int), x.astype(int)]
    return np.asarray(barrel + edge + 0.5 * shade, np.float32) + 0.5 * noise.fractal(random, x.shape, 0.7, low=6.0)


def _fibres(random: Generator) -> Image:
    shape = (SIZE_PX, SIZE_PX)
    streaks = np.zeros(shape, np.float32)
    for rows, weight in ((1, 1.0), (3, 0.7), (9, 0.5)):
        line = noise.fractal(random, (SIZE_PX // rows + 1, SIZE_PX), 0.9, low=1.0, high=60.0)
        streaks += weight * np.repeat(line, rows, axis=0)[:SIZE_PX]
    return noise.standardised(noise.blurred(streaks, 0.8)) + 0.4 * noise.fractal(random, shape, 0.8, low=10.0)


def _stones(random: Generator) -> Image:
    """Loose stones of several sizes, lit from one side, on grains."""
    shape = (SIZE_PX, SIZE_PX)
    total = 0.8 * noise.fractal(random, shape, 0.8, low=4.0)
    for count, coverage in ((120, 0.20), (700, 0.25), (4000, 0.3)):
        nearest, second, number = noise.cells(random, SIZE_PX, count, warp_px=SIZE_PX / count**0.5 * 0.12)
        radius = SIZE_PX / count**0.5 * (0.16 + 0.30 * random.random(count))[number]
        there = (random.random(count) < coverage)[number]
        dome = np.where(there, np.sqrt(np.maximum(1.0 - (nearest / radius) ** 2, 0.0)) * radius, 0.0)
        inside = (dome > 0.0).astype(np.float32)
        shade = noise.shaded_relief(noise.blurred(dome, 1.0), 0.5)
        tone = 0.5 * random.standard_normal(count)[number]
        shadow = np.roll(inside, (5, 5), axis=(0, 1)) * (1.0 - inside)
        total = total * (1.0 - inside) + inside * (1.6 * shade + tone) - 1.3 * noise.blurred(shadow, 1.2)
        del second
    return np.asarray(total, np.float32)


def _regolith(random: Generator) -> Image:
    return np.asarray(_photograph("moon") + 0.6 * noise.fractal(random, (SIZE_PX, SIZE_PX), 1.0, low=3.0), np.float32)


def _leaves(random: Generator) -> Image:
    nearest, second, number = noise.cells(random, SIZE_PX, 2600, warp_px=5.0)
    tone = random.standard_normal(2600)[number]
    depth = noise.fractal(random, (SIZE_PX, SIZE_PX), 1.0, low=4.0, high=60.0)
    return np.asarray(tone + 1.2 * depth - 1.5 * np.exp(-(((second - nearest) / 2.5) ** 2)), np.float32)


def _plain(_: Generator) -> Image:
    return np.zeros((SIZE_PX, SIZE_PX), np.float32)


_MAKERS: dict[str, Callable[[Generator], Image]] = {
    "blades": _blades,
    "pebbles": _pebbles,
    "speckle": _speckle,
    "clumps": _clumps,
    "stains": _stains,
    "cracks": _cracks,
    "tiles": _tiles,
    "bricks": _bricks,
    "fibres": _fibres,
    "stones": _stones,
    "regolith": _regolith,
    "leaves": _leaves,
    "plain": _plain,
}


def read_picture(path: Path) -> Image:
    """A user's picture in grey, linear in no particular unit."""
    picture = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    if picture is None:
        raise InputError(f"{path}: not readable as a picture; expected one of {' '.join(PICTURES)}")
    if min(picture.shape) < 64:
        raise InputError(f"{path}: is {picture.shape[1]} x {picture.shape[0]} px; expected at least 64 px each way")
    return picture.astype(np.float32)


@dataclass(frozen=True)
class TextureSet:
    """Texture array and which of its layers each material shows."""

    layers: npt.NDArray[np.uint8]  #: (L, SIZE_PX, SIZE_PX), mean about half scale
    layer_of: npt.NDArray[np.int32]  #: (materials, 2) fine, coarse


def _quantised(image: Image) -> npt.NDArray[np.uint8]:
    level = 255.0 * (0.5 + _CONTRAST * noise.standardised(image))
    return np.asarray(np.clip(level + 0.5, 0.0, 255.0).astype(np.uint8))


@cache
def _layer(name: str) -> npt.NDArray[np.uint8]:
    return layer_store.kept(name, lambda: _quantised(_MAKERS[name](stream(_LOOK_SEED, name))), layer_store.FOLDER)


def texture_set(used: set[str], pictures: dict[str, Path]) -> TextureSet:
    """The layers of the materials that are used; other materials get a plain one. `pictures`: material names and the
    user's pictures that take the place of their finest layer.
    """
    names = ["plain", *sorted({layer for name in used for layer in MATERIALS[name].layers} - {"plain"})]
    images = [_layer(name) for name in names]
    number = {name: index for index, name in enumerate(names)}
    layer_of = np.array([[number.get(layer, 0) for layer in m.layers] for m in MATERIALS.values()], np.int32)
    for name, path in sorted(pictures.items()):
        layer_of[INDEX[name], 0] = len(images)
        images.append(_quantised(_seamless(read_picture(path))))
    return TextureSet(np.stack(images), layer_of)
