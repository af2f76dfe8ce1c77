from __future__ import annotations

import numpy as np
import pytest

from motiongen.export.rasterizer import Camera, cover, draw_mesh, draw_shadow, floor, normals_of

# A cube of one metre on the floor, counter-clockwise from outside.
CUBE = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (0.0, 1.0)], np.float32)
SIDES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
FACES = np.array([face for a, b, c, d in SIDES for face in ((a, b, c), (a, c, d))])


def camera(azimuth: float = 0.0, size: tuple[int, int] = (80, 80)) -> Camera:
    return Camera.looking(np.array([0, 0, 0.5], np.float32), azimuth, 0.4, 5.0, 0.5, size)


@pytest.mark.parametrize("scale", [0.5, 5.0, 40.0])
def test_covered_pixels_agree_with_a_loop(scale: float) -> None:
    rng = np.random.default_rng(0)
    corners = rng.uniform(-5, 35, (30, 1, 2)) + rng.normal(0, scale, (30, 3, 2))
    points, faces = corners.reshape(-1, 2).astype(np.float32), np.arange(90).reshape(30, 3)
    pixel, face, share = cover(points, faces, (30, 20))
    found = set(zip(pixel.tolist(), face.tolist(), strict=True))
    expected = set()
    for number, triangle in enumerate(points[faces].astype(float)):
        inverse = np.linalg.inv(np.vstack([triangle.T, np.ones(3)]))
        for y in range(20):
            for x in range(30):
                least = (inverse @ [x + 0.5, y + 0.5, 1]).min()
                if least > 1e-4:
                    expected.add((y * 30 + x, number))
                elif least > -1e-4:
                    found.discard((y * 30 + x, number))  # on an edge: either will do
    assert found == expected
    rebuilt = (points[faces[face]] * share[..., None]).sum(axis=1)
    np.testing.assert_allclose(rebuilt, np.stack([pixel % 30, pixel // 30], axis=1) + 0.5, atol=1e-3)


def test_the_camera_sees_its_target_in_the_middle_and_up_above() -> None:
    view = camera()
    points, depth = view.project(np.array([[0, 0, 0.5], [0, 0, 0.9], [0.4, 0, 0.5]], np.float32))
    np.testing.assert_allclose(points[0], [40, 40], atol=1e-4)
    assert depth[0] == pytest.approx(5.0)
    assert points[1, 1] < 40  # rows count downward
    assert points[2, 0] > 40  # looking along +y, +x is to the right


def test_normals_of_a_cube_point_outward() -> None:
    normals = normals_of(CUBE, FACES)
    outward = CUBE - [0, 0, 0.5]
    assert ((normals * outward).sum(axis=1) > 0).all()
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, rtol=1e-5)


def test_nearer_surfaces_hide_farther_ones() -> None:
    view, far = camera(), CUBE + np.array([0, 3, 0], np.float32)
    red, blue = np.array([1, 0, 0], np.float32), np.array([0, 0, 1], np.float32)
    both, colors = np.concatenate([far, CUBE]), np.concatenate([np.tile(blue, (8, 1)), np.tile(red, (8, 1))])
    for faces in (np.concatenate([FACES, FACES + 8]), np.concatenate([FACES + 8, FACES])):
        canvas = np.ones((80, 80, 3), np.float32)
        draw_mesh(canvas, view, both, faces, colors)
        middle = canvas[40, 40]
        assert middle[0] > 2 * middle[2]


def test_opacity_blends_with_what_lies_behind() -> None:
    solid, half = np.zeros((80, 80, 3), np.float32), np.zeros((80, 80, 3), np.float32)
    draw_mesh(solid, camera(), CUBE, FACES, np.ones(3, np.float32))
    draw_mesh(half, camera(), CUBE, FACES, np.ones(3, np.float32), opacity=0.5)
    np.testing.assert_allclose(half, solid / 2, atol=1e-6)


def test_shadows_darken_the_floor_away_from_the_light_only() -> None:
    view = camera(size=(160, 160))
    canvas = np.ones((160, 160, 3), np.float32)
    draw_shadow(canvas, view, CUBE, FACES)
    darkened = np.argwhere(canvas.min(axis=-1) < 0.9)
    assert len(darkened) > 100
    foot = view.project(np.zeros((1, 3), np.float32))[0][0]
    assert darkened[:, 1].mean() > foot[0]  # the light stands on the left


def test_blocks_of_the_floor_look_like_its_pixels() -> None:
    view = camera(0.7, (160, 160))
    fine, coarse = floor(view, np.zeros(2), 5.0), floor(view, np.zeros(2), 5.0, 2)
    assert fine.shape == coarse.shape
    assert np.abs(fine - coarse).mean() < 0.01
