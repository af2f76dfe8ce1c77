"""SMPL parameters as the AMASS archive stores them (Mahmood et al. 2019): an NPZ file of plain arrays."""

from __future__ import annotations

import io

import numpy as np
import roma

from motiongen.export.scene import Scene
from motiongen.motion.bodies.body import SmplModel
from motiongen.motion.representation import unpack
from motiongen.motion.skeleton import JOINTS

POSES = {"smpl": 24, "smplh": 52, "smplx": 55}
"""Joints of each model: the 22 of the body, then hands, with SMPL-X jaw and eyes before them."""
BETAS = 16
"""Shape coefficients that AMASS stores at least."""
NEUTRAL = SmplModel(name="smplh", gender="neutral", betas=(), rest_pelvis=(-0.001795, -0.223333, 0.028219))
"""Stands for a body outside the SMPL family. J0 is that of SMPL's neutral mean body; other models have another."""


def encode_amass(scene: Scene) -> bytes:
    """The motion as SMPL parameters, z up, metres, radians.

    - `poses` (T, 156) for SMPL-H, (T, 72) for SMPL, (T, 165) for SMPL-X: axis angles of all joints of the model that
      the scene's body was made from, of SMPL-H if it was made from none. The first 66 are the body's; hands, jaw and
      eyes are zero.
    - `trans` (T, 3): SMPL turns a body about its rest pelvis J0 and then adds `trans`, so that the pelvis comes to lie
      at J0 + trans. What is stored is the pelvis' position minus J0.
    - `rest_pelvis` (3,): that J0; `trans` + `rest_pelvis` is the pelvis' position.
    - `betas` (16,) or more, `gender`, `surface_model_type`: the model, zero betas and neutral if there is none.
    - `mocap_framerate` and `mocap_frame_rate`: the same number under the names of both of AMASS's releases.

    The file holds no bones: whoever opens it sees the joint positions of the model's own skeleton, not those of a
    skeleton that the scene's body was fitted to.
    """
    model = scene.body.model or NEUTRAL
    rotations, pelvis = unpack(scene.features.detach().cpu().double())
    poses = np.zeros((scene.frames, 3 * POSES[model.name]))
    poses[:, : 3 * JOINTS] = roma.rotmat_to_rotvec(rotations).flatten(1).numpy()
    betas = np.zeros(max(BETAS, len(model.betas)))
    betas[: len(model.betas)] = model.betas
    file = io.BytesIO()
    np.savez_compressed(
        file,
        poses=poses,
        trans=pelvis.numpy() - np.array(model.rest_pelvis),
        rest_pelvis=np.array(model.rest_pelvis),
        betas=betas,
        gender=np.array(model.gender),
        surface_model_type=np.array(model.name),
        mocap_framerate=np.array(scene.fps),
        mocap_frame_rate=np.array(scene.fps),
    )
    return file.getvalue()
