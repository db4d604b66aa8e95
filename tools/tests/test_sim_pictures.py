"""The user's own pictures: orthophotos on the ground, textures in the place of a material's."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from plumb_tools.sim import prepare, scene_file, world
from plumb_tools.sim.materials import INDEX
from plumb_tools.sim.simulate import Plan
from plumb_tools.sim.textures import SIZE_PX
from plumb_tools.trajectory import InputError
from sim_scenes import changed, write

BARE = {"scene.objects": [], "scene.ground.extent_m": [-10, -10, 12, 10], "scene.ground.orthophoto_m_per_px": 0.05}


def _with(folder: Path, pictures: Path) -> Plan:
    path = write(folder, changed(BARE))
    return prepare.plan(scene_file.read(path), path, 0, None, pictures, lambda *_: None)


def _picture(folder: Path, name: str, picture: np.ndarray) -> Path:
    folder.mkdir(exist_ok=True)
    assert cv2.imwrite(str(folder / name), picture)
    return folder


def test_an_orthophoto_lies_on_the_ground_at_its_scale(tmp_path: Path) -> None:
    photo = np.full((160, 160), 60, np.uint8)
    photo[:, 80:] = 180
    albedo = _with(tmp_path, _picture(tmp_path / "photos", "yard.png", photo)).world.ground.albedo.astype(float)
    # 8 m wide, then mirrored: dark from 0 to 4 m, bright to 12 m, dark to 20 m.
    columns = albedo.mean(axis=0)
    at = [columns[round(x / 22.0 * len(columns))] for x in (2.0, 6.0, 10.0, 14.0, 18.0)]
    assert np.array(at) / at[0] == pytest.approx([1.0, 3.0, 3.0, 1.0, 1.0], rel=0.03)
    assert np.ptp(albedo, axis=0).max() <= 1.0


def test_a_picture_named_after_a_material_is_its_texture(tmp_path: Path) -> None:
    stripes = np.tile(np.repeat(np.array([40, 200] * 8, np.uint8), 40), (640, 1))
    textures = _with(tmp_path, _picture(tmp_path / "looks", "linoleum.png", stripes)).world.textures
    layer = textures.layers[textures.layer_of[INDEX["linoleum"], 0]].astype(float)
    assert layer.shape == (SIZE_PX, SIZE_PX)
    assert layer.std(axis=1).min() > 5.0 * layer.std(axis=0).max()  # striped across, even along


@pytest.mark.parametrize(
    ("name", "content", "expected"),
    [("yard.png", b"not a picture", "not readable as a picture"), ("notes.txt", b"", "holds no picture")],
)
def test_what_is_no_picture_is_refused_by_name(name: str, content: bytes, expected: str, tmp_path: Path) -> None:
    folder = tmp_path / "photos"
    folder.mkdir()
    (folder / name).write_bytes(content)
    with pytest.raises(InputError, match=expected) as caught:
        _with(tmp_path, folder)
    assert str(folder) in str(caught.value)


def test_a_tiny_picture_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="is 20 x 10 px; expected at least 64 px"):
        _with(tmp_path, _picture(tmp_path / "photos", "yard.png", np.zeros((10, 20), np.uint8)))


def test_pictures_are_told_apart_by_their_names(tmp_path: Path) -> None:
    plain = np.zeros((64, 64), np.uint8)
    for name in ("grass.png", "yard.jpg", "field.tif"):
        folder = _picture(tmp_path / "mixed", name, plain)
    found = world.find_pictures(folder)
    assert set(found.materials) == {"grass"}
    assert [path.name for path in found.orthophotos] == ["field.tif", "yard.jpg"]
