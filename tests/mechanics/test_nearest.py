"""Where rays meet a surface."""

import numpy as np
import trimesh

from palpate.mechanics.shape.nearest import first_hits


def test_rays_meet_a_cube_where_they_must() -> None:
    cube = trimesh.creation.box((0.02, 0.02, 0.02))
    starts = np.array([[0.003, 0.001, 0.05], [0.003, 0.001, 0.0], [0.05, 0.05, 0.05], [0.003, 0.001, 0.05]])
    ways = np.array([[0, 0, -1.0], [1.0, 0, 0], [0, 0, 1.0], [0, 0, 1.0]])
    far, face = first_hits(cube.vertices, cube.faces, starts, ways)
    assert np.allclose(far[:2], [0.04, 0.007], atol=1e-15)
    assert np.allclose(cube.face_normals[face[:2]], [[0, 0, 1], [1, 0, 0]])
    assert np.isinf(far[2:]).all() and (face[2:] == -1).all()


def test_the_near_side_is_passed_over() -> None:
    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.03)
    far, _ = first_hits(
        ball.vertices, ball.faces, np.array([[0, 0, 0.03]]), np.array([[0, 0, -1.0]]), beyond=1e-3
    )
    assert abs(far[0] - 0.06) < 1e-4


def test_a_ray_along_a_wall_meets_no_place_of_it() -> None:
    cube = trimesh.creation.box((0.02, 0.02, 0.02))
    with np.errstate(all="raise"):
        far, face = first_hits(
            cube.vertices, cube.faces, np.array([[0.01, 0.003, 0.05]]), np.array([[0, 0, -1.0]])
        )
    assert face[0] < 0 or abs(cube.face_normals[face[0]][2]) == 1
    assert not np.isnan(far[0])


def test_a_ray_is_out_of_a_body_only_where_no_other_part_of_it_goes_on() -> None:
    # two blocks cross: their inner faces are no wall, nor is a facet below a place that a curve puts above it
    blocks = [trimesh.creation.box((0.02, 0.02, 0.02)), trimesh.creation.box((0.02, 0.02, 0.02))]
    blocks[1].apply_translation([0, 0, 0.015])
    both = trimesh.util.concatenate(blocks)
    starts = np.array([[0.003, 0.001, 0.0255], [0.0, 0.0, 0.025], [0.003, 0.001, -0.01]])
    ways = np.array([[0, 0, -1.0], [0, 0, -1.0], [0, 0, 1.0]])
    far, face = first_hits(both.vertices, both.faces, starts, ways, beyond=1e-4, leaving=True)
    assert np.allclose(far, [0.0355, 0.035, 0.035], atol=1e-12)
    assert np.allclose(both.face_normals[face], ways)
    assert np.allclose(first_hits(both.vertices, both.faces, starts, ways, beyond=1e-4)[0][0], 5e-4)
