"""Surface materials: which texture layer shows at which scale, and how strongly.

Every surface is shaded with two layers laid over one another, each repeating at its own scale, over its albedo, which
on the ground is painted (`ground_map.py`). So there is detail to track from a hand's breadth to the height of a tall
building: what is too fine to be seen has faded to its mean by mip-mapping while the next coarser takes over.
"""

from __future__ import annotations

from dataclasses import dataclass

#: Edge lengths [m] of the repeating squares, fine and coarse. Not multiples of one another, so that repetitions do not
#: line up.
TILE_M = (0.9, 6.1)


@dataclass(frozen=True)
class Material:
    """Layers and strengths, fine and coarse. Strength 1 swings the albedo by the layer's full contrast."""

    layers: tuple[str, str]
    strengths: tuple[float, float]
    albedo: float  #: reflected share of the light where nothing else is said


MATERIALS: dict[str, Material] = {
    "grass": Material(("blades", "clumps"), (0.75, 0.6), 0.30),
    "soil": Material(("pebbles", "clumps"), (0.9, 0.8), 0.38),
    "sand": Material(("speckle", "stones"), (0.7, 0.8), 0.48),
    "gravel": Material(("pebbles", "stones"), (1.1, 0.7), 0.42),
    "asphalt": Material(("speckle", "cracks"), (0.9, 0.8), 0.24),
    "concrete": Material(("speckle", "stains"), (0.6, 0.9), 0.55),
    "paint": Material(("speckle", "cracks"), (0.4, 0.5), 0.85),
    "roof_tiles": Material(("tiles", "stains"), (1.2, 0.7), 0.34),
    "slate": Material(("tiles", "cracks"), (0.9, 0.7), 0.22),
    "bitumen": Material(("pebbles", "stains"), (0.7, 0.9), 0.28),
    "brick": Material(("bricks", "stains"), (1.0, 0.6), 0.36),
    "plaster": Material(("speckle", "stains"), (0.4, 0.7), 0.62),
    "metal": Material(("fibres", "stains"), (0.3, 0.4), 0.5),
    "glass": Material(("plain", "stains"), (0.0, 0.4), 0.08),
    "leaves": Material(("leaves", "clumps"), (1.2, 0.9), 0.22),
    "rock": Material(("speckle", "cracks"), (1.0, 0.9), 0.40),
    "regolith": Material(("pebbles", "stones"), (0.8, 0.8), 0.40),
    "cardboard": Material(("fibres", "stains"), (0.22, 0.30), 0.45),
    "linoleum": Material(("speckle", "stains"), (0.22, 0.25), 0.40),
    "wood": Material(("fibres", "fibres"), (0.8, 0.6), 0.38),
    "water": Material(("plain", "plain"), (0.0, 0.0), 0.10),
}

#: Numbers by which shader and ground map know the materials.
INDEX = {name: number for number, name in enumerate(MATERIALS)}
