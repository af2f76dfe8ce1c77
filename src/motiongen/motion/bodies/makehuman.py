"""The body that ships with motiongen: the default MakeHuman figure (CC0)."""

from __future__ import annotations

from importlib.resources import files

import numpy as np
import torch

from motiongen.motion.bodies.body import Body
from motiongen.motion.skeleton import PARENTS, Skeleton


def makehuman() -> Body:
    """The default MakeHuman figure: 1.63 m, 13524 vertices, 4 weights per vertex.

    `assets/README.md` says where it comes from; `tools/make_body.py` makes it.
    """
    with (files("motiongen.motion.bodies") / "assets" / "makehuman.npz").open("rb") as file:
        arrays = np.load(file, allow_pickle=False)
        joints = torch.from_numpy(arrays["joints"])
        rest = torch.from_numpy(arrays["vertices"])
        faces = torch.from_numpy(arrays["faces"].astype(np.int64))
        indices = torch.from_numpy(arrays["weight_joints"].astype(np.int64))
        values = torch.from_numpy(arrays["weights"].astype(np.float32) / 255)
    weights = torch.zeros(len(rest), len(joints)).scatter_add_(1, indices, values)
    offsets = torch.cat([torch.zeros(1, 3), joints[1:] - joints[list(PARENTS[1:])]])
    return Body(Skeleton(offsets), faces, rest, weights)
