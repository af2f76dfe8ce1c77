"""A glTF file poses its figure by itself: everything expected of it is computed from the file's bytes alone."""

from __future__ import annotations

import json
import struct
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation, Slerp

from motiongen.export.scene import Scene
from motiongen.export.write import write
from motiongen.motion.bodies import makehuman, smpl
from motiongen.motion.kinematics import joint_positions
from motiongen.motion.representation import unpack
from motiongen.motion.skeleton import JOINT_NAMES, JOINTS
from tests.export.motions import swinging, tumbling
from tests.motion.bodies.test_smpl import model
from tests.motion.bodies.test_smpl import write as write_model

DTYPES = {5121: "u1", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}


class Glb:
    """A file taken apart by the glTF 2.0 specification."""

    def __init__(self, path: Path) -> None:
        content = path.read_bytes()
        magic, version, length = struct.unpack_from("<4sII", content)
        assert (magic, version, length) == (b"glTF", 2, len(content))
        size, kind = struct.unpack_from("<I4s", content, 12)
        assert (kind, size % 4) == (b"JSON", 0)
        self.json: dict[str, Any] = json.loads(content[20 : 20 + size])
        blob, kind = struct.unpack_from("<I4s", content, 20 + size)
        assert (kind, blob % 4, 28 + size + blob) == (b"BIN\0", 0, length)
        self.blob = content[28 + size :]

    def array(self, accessor: int) -> np.ndarray:
        """(N, width)"""
        entry = self.json["accessors"][accessor]
        view = self.json["bufferViews"][entry["bufferView"]]
        start = view.get("byteOffset", 0) + entry.get("byteOffset", 0)
        width = WIDTHS[entry["type"]]
        assert start % 4 == 0
        values = np.frombuffer(self.blob, DTYPES[entry["componentType"]], entry["count"] * width, start)
        return values.reshape(-1, width)

    def primitive(self, attribute: str) -> np.ndarray:
        return self.array(self.json["meshes"][0]["primitives"][0]["attributes"][attribute])

    def tracks(self) -> dict[tuple[str, str], tuple[np.ndarray, np.ndarray]]:
        """(node's name, path) -> times (T,) and values (T, width)."""
        (animation,) = self.json["animations"]
        found = {}
        for channel in animation["channels"]:
            sampler = animation["samplers"][channel["sampler"]]
            assert sampler.get("interpolation", "LINEAR") == "LINEAR"
            key = (self.json["nodes"][channel["target"]["node"]]["name"], channel["target"]["path"])
            found[key] = self.array(sampler["input"])[:, 0], self.array(sampler["output"])
        return found

    def transforms(self, time: float) -> np.ndarray:
        """World transforms (22, 4, 4) of the skin's joints at a time, by the nodes' tree."""
        tracks, world = self.tracks(), {}

        def place(number: int, above: np.ndarray) -> None:
            node, local = self.json["nodes"][number], np.eye(4)
            local[:3, 3] = node.get("translation", [0, 0, 0])
            if (node["name"], "translation") in tracks:
                times, values = tracks[node["name"], "translation"]
                local[:3, 3] = [np.interp(time, times, column) for column in values.T]
            if (node["name"], "rotation") in tracks:
                times, values = tracks[node["name"], "rotation"]
                local[:3, :3] = Slerp(times, Rotation.from_quat(values))(time).as_matrix()
            world[number] = above @ local
            for child in node.get("children", []):
                place(child, world[number])

        for root in self.json["scenes"][self.json["scene"]]["nodes"]:
            place(root, np.eye(4))
        return np.array([world[joint] for joint in self.json["skins"][0]["joints"]])

    def vertices(self, time: float) -> np.ndarray:
        """The skinned mesh (V, 3) at a time."""
        inverse = self.array(self.json["skins"][0]["inverseBindMatrices"]).reshape(-1, 4, 4).transpose(0, 2, 1)
        matrices = self.transforms(time) @ inverse
        points = np.pad(self.primitive("POSITION"), ((0, 0), (0, 1)), constant_values=1.0)
        joints, weights = self.primitive("JOINTS_0"), self.primitive("WEIGHTS_0")
        return np.einsum("vk,vkab,vb->va", weights, matrices[joints], points)[:, :3]


def written(path: Path, scene: Scene) -> Glb:
    write(path, scene)
    return Glb(path)


def z_up(points: np.ndarray) -> np.ndarray:
    return np.stack([points[..., 0], -points[..., 2], points[..., 1]], axis=-1)


@pytest.mark.parametrize("make", [swinging, tumbling])
def test_joints_and_skinned_vertices_come_back(tmp_path: Path, make: Any) -> None:
    scene = make()
    glb = written(tmp_path / "motion.glb", scene)
    joints = joint_positions(scene.features, scene.body.skeleton).numpy()
    for frame in (0, 5, scene.frames - 1):
        time = float(np.float32(frame / 30))
        assert np.abs(z_up(glb.transforms(time)[:, :3, 3]) - joints[frame]).max() < 1e-5
        expected = scene.body.vertices(*unpack(scene.features[frame])).numpy()
        assert np.abs(z_up(glb.vertices(time)) - expected).max() < 1e-5


def test_keys_are_unit_quaternions_that_take_the_short_way_at_the_scenes_rate(tmp_path: Path) -> None:
    tracks = written(tmp_path / "motion.glb", replace(tumbling(), fps=24.0)).tracks()
    assert set(tracks) == {("pelvis", "translation"), *((name, "rotation") for name in JOINT_NAMES)}
    for (_, path), (times, values) in tracks.items():
        np.testing.assert_allclose(times, np.arange(40) / 24, rtol=1e-6)
        if path == "rotation":
            np.testing.assert_allclose(np.linalg.norm(values, axis=1), 1, atol=1e-6)
            assert ((values[1:] * values[:-1]).sum(axis=1) > 0).all()


def test_trimesh_sees_the_figure_in_its_t_pose_on_the_floor(tmp_path: Path) -> None:
    body = makehuman()
    write(tmp_path / "motion.glb", tumbling())
    found = trimesh.load_scene(tmp_path / "motion.glb", process=False)
    (mesh,) = found.geometry.values()
    np.testing.assert_array_equal(mesh.faces, body.faces.numpy())
    assert mesh.vertices[:, 1].min() == pytest.approx(0, abs=1e-6)
    np.testing.assert_allclose(mesh.vertices - mesh.vertices[0], (body.rest - body.rest[0]).numpy(), atol=1e-5)
    pelvis = found.graph["pelvis"][0][:3, 3]
    for joint, name in enumerate(JOINT_NAMES):
        np.testing.assert_allclose(found.graph[name][0][:3, 3] - pelvis, body.rest_joints[joint].numpy(), atol=1e-5)
    np.testing.assert_allclose(np.linalg.norm(mesh.vertex_normals, axis=1), 1, atol=1e-5)
    own = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    turned = (own.face_normals[:, None] * mesh.vertex_normals[mesh.faces]).sum(axis=-1)
    assert (turned > 0).mean() > 0.98  # outward: of a face's corners nearly all agree with it


def test_the_four_strongest_weights_add_up_to_one(tmp_path: Path) -> None:
    """A body whose every vertex hangs on all joints."""
    body = smpl(write_model(tmp_path / "model.npz", model(24)))
    glb = written(tmp_path / "motion.glb", tumbling(frames=2, body=body))
    joints, weights = glb.primitive("JOINTS_0"), glb.primitive("WEIGHTS_0")
    dense = body.weights.numpy()
    np.testing.assert_allclose(weights.sum(axis=1), 1, atol=1e-6)
    for vertex in range(len(dense)):
        strongest = np.argsort(-dense[vertex])[:4]
        assert joints[vertex].tolist() == strongest.tolist()
        kept = dense[vertex, strongest]
        np.testing.assert_allclose(weights[vertex], kept / kept.sum(), atol=1e-6)


def test_unused_influences_name_joint_zero(tmp_path: Path) -> None:
    glb = written(tmp_path / "motion.glb", tumbling(frames=1))
    joints, weights = glb.primitive("JOINTS_0"), glb.primitive("WEIGHTS_0")
    assert (weights == 0).any()
    assert not joints[weights == 0].any()
    assert joints.max() < JOINTS


def test_bounds_are_given_where_gltf_asks_for_them(tmp_path: Path) -> None:
    glb = written(tmp_path / "motion.glb", tumbling())
    for accessor in (
        glb.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"],
        glb.json["animations"][0]["samplers"][0]["input"],
    ):
        values, entry = glb.array(accessor), glb.json["accessors"][accessor]
        assert entry["min"] == pytest.approx(values.min(axis=0).tolist(), abs=1e-9)
        assert entry["max"] == pytest.approx(values.max(axis=0).tolist(), abs=1e-9)


def test_a_single_frame_is_an_animation_too(tmp_path: Path) -> None:
    scene = tumbling(frames=1)
    glb = written(tmp_path / "still.glb", scene)
    times, values = glb.tracks()["pelvis", "translation"]
    assert times.tolist() == [0.0]
    np.testing.assert_allclose(z_up(values), scene.features[:, 132:].numpy(), atol=1e-6)
