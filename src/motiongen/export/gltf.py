"""Binary glTF 2.0: the skinned figure and its animation in one file."""

from __future__ import annotations

from typing import Any

import numpy as np
import pygltflib as gltf
import roma
import torch
from numpy.typing import NDArray
from torch import Tensor

from motiongen.export.axes import y_up_pose
from motiongen.export.rasterizer import normals_of
from motiongen.export.scene import Scene
from motiongen.motion.bodies.body import Body
from motiongen.motion.skeleton import JOINT_NAMES, JOINTS, PARENTS

INFLUENCES = 4
"""Joints that move a vertex at most, as every program supports."""
COLOR = [0.47, 0.56, 0.76, 1.0]
"""Linear RGBA."""
COMPONENTS = {"float32": gltf.FLOAT, "uint8": gltf.UNSIGNED_BYTE, "uint32": gltf.UNSIGNED_INT}
TYPES = {(): gltf.SCALAR, (3,): gltf.VEC3, (4,): gltf.VEC4, (4, 4): gltf.MAT4}


def encode_glb(scene: Scene) -> bytes:
    """The motion on its body in a world whose y is up, in metres and seconds; joints bear SMPL's names.

    Without its animation the figure stands in SMPL's T-pose with its soles on the floor and faces +z. Every vertex
    follows its four strongest joints, with weights that add up to 1; SMPL's pose blend shapes stay out.
    """
    body = scene.body.to("cpu")
    # The bind pose is that of the nodes: programs that ignore skins or animations show a figure on the floor.
    lift = torch.tensor([0.0, -float(body.rest[:, 1].min()), 0.0])
    file = gltf.GLTF2(
        asset=gltf.Asset(version="2.0", generator="motiongen"),
        scene=0,
        scenes=[gltf.Scene(name=scene.title, nodes=[0, JOINTS])],
        nodes=[*_joint_nodes(body, lift), gltf.Node(name="figure", mesh=0, skin=0)],
        materials=[
            gltf.Material(
                name="figure",
                pbrMetallicRoughness=gltf.PbrMetallicRoughness(
                    baseColorFactor=COLOR, metallicFactor=0.0, roughnessFactor=0.8
                ),
                alphaCutoff=None,
            )
        ],
    )
    data = _Data(file)
    file.meshes = [gltf.Mesh(name="figure", primitives=[_primitive(data, body, lift)])]
    file.skins = [
        gltf.Skin(name="skeleton", joints=list(range(JOINTS)), inverseBindMatrices=_inverse_bind(data, body, lift))
    ]
    file.animations = [_animation(data, scene)]
    return data.finish()


def _joint_nodes(body: Body, lift: Tensor) -> list[gltf.Node]:
    """Node j is joint j, in the T-pose."""
    places = body.skeleton.offsets.clone()
    places[0] += lift
    return [
        gltf.Node(
            name=name,
            translation=place.tolist(),
            children=[child for child, parent in enumerate(PARENTS) if parent == joint],
        )
        for joint, (name, place) in enumerate(zip(JOINT_NAMES, places, strict=True))
    ]


def _primitive(data: _Data, body: Body, lift: Tensor) -> gltf.Primitive:
    weights, joints = body.weights.topk(INFLUENCES, dim=1)
    weights = weights / weights.sum(dim=1, keepdim=True)
    # An influence of nothing has to name joint 0.
    joints = torch.where(weights > 0, joints, 0)
    vertices, faces = (body.rest + lift).numpy(), body.faces.numpy()
    return gltf.Primitive(
        attributes=gltf.Attributes(
            POSITION=data.add(vertices, "float32", target=gltf.ARRAY_BUFFER, bounds=True),
            NORMAL=data.add(normals_of(vertices, faces), "float32", target=gltf.ARRAY_BUFFER),
            JOINTS_0=data.add(joints.numpy(), "uint8", target=gltf.ARRAY_BUFFER),
            WEIGHTS_0=data.add(weights.numpy(), "float32", target=gltf.ARRAY_BUFFER),
        ),
        indices=data.add(faces.reshape(-1), "uint32", target=gltf.ELEMENT_ARRAY_BUFFER),
        material=0,
    )


def _inverse_bind(data: _Data, body: Body, lift: Tensor) -> int:
    """From the mesh's frame to every joint's: rest joints are not turned, so the inverse is a step back."""
    matrices = torch.eye(4).repeat(JOINTS, 1, 1)
    matrices[:, :3, 3] = -(body.rest_joints + lift)
    return data.add(matrices.transpose(-1, -2).numpy(), "float32")  # glTF stores columns one after the other


def _animation(data: _Data, scene: Scene) -> gltf.Animation:
    rotations, pelvis = y_up_pose(scene)
    quaternions = _same_signs(roma.rotmat_to_unitquat(rotations).numpy())
    times = data.add(np.arange(scene.frames) / scene.fps, "float32", bounds=True)
    samplers = [gltf.AnimationSampler(input=times, output=data.add(pelvis.numpy(), "float32"))]
    targets = [gltf.AnimationChannelTarget(node=0, path=gltf.TRANSLATION)]
    for joint in range(JOINTS):
        samplers.append(gltf.AnimationSampler(input=times, output=data.add(quaternions[:, joint], "float32")))
        targets.append(gltf.AnimationChannelTarget(node=joint, path=gltf.ROTATION))
    return gltf.Animation(
        name=scene.title,
        samplers=samplers,
        channels=[gltf.AnimationChannel(sampler=index, target=target) for index, target in enumerate(targets)],
    )


def _same_signs(quaternions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Quaternions (T, J, 4) of the same rotations, of q and -q the one that is nearer to the frame before."""
    products = (quaternions[1:] * quaternions[:-1]).sum(axis=-1, keepdims=True)
    signs = np.cumprod(np.where(products < 0, -1.0, 1.0), axis=0)
    return np.concatenate([quaternions[:1], signs * quaternions[1:]])


class _Data:
    """Collects the file's arrays."""

    def __init__(self, file: gltf.GLTF2) -> None:
        self._file = file
        self._bytes = bytearray()

    def add(self, values: NDArray[Any], dtype: str, *, target: int | None = None, bounds: bool = False) -> int:
        """The number of a new accessor for values (N, ...); glTF asks for `bounds` of vertices and times."""
        values = np.ascontiguousarray(values, dtype=np.dtype(dtype).newbyteorder("<"))
        content = values.tobytes()
        columns = values.reshape(len(values), -1)
        self._file.bufferViews.append(
            gltf.BufferView(buffer=0, byteOffset=len(self._bytes), byteLength=len(content), target=target)
        )
        self._file.accessors.append(
            gltf.Accessor(
                bufferView=len(self._file.bufferViews) - 1,
                componentType=COMPONENTS[dtype],
                count=len(values),
                type=TYPES[values.shape[1:]],
                min=columns.min(axis=0).tolist() if bounds else None,
                max=columns.max(axis=0).tolist() if bounds else None,
            )
        )
        # Every array starts at a multiple of 4 bytes.
        self._bytes += content + bytes(-len(content) % 4)
        return len(self._file.accessors) - 1

    def finish(self) -> bytes:
        """The whole file."""
        self._file.buffers = [gltf.Buffer(byteLength=len(self._bytes))]
        self._file.set_binary_blob(bytes(self._bytes))
        return b"".join(self._file.save_to_bytes())
