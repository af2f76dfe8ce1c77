"""Forms in which a generator's stages see a pose (ACTOR, appendix A.4): joint rotations, then the pelvis' position.

Outside of a generator a pose is in 6D form (motiongen.motion.representation): losses, metrics and exports know no
other.
"""

from __future__ import annotations

from typing import ClassVar

import roma
import torch
import torch.nn.functional as F
from torch import Tensor

from motiongen.motion.rotations import matrix_from_rot6d, rot6d_from_matrix

ROT6D = 6
POSITION = 3


class Rot6d:
    """The data's own form: two columns of every rotation matrix (Zhou et al. 2019). Encoding changes nothing."""

    def __init__(self, features: int) -> None:
        self.features = features

    def encode(self, features: Tensor) -> Tensor:
        return features

    def decode(self, features: Tensor) -> Tensor:
        return features


class RotationForm:
    """A form of `numbers` for every joint's rotation.

    Args:
        features: F, numbers of a pose in 6D form.
    """

    numbers: ClassVar[int]

    def __init__(self, features: int) -> None:
        joints = (features - POSITION) // ROT6D
        self.features = joints * self.numbers + POSITION

    def encode(self, features: Tensor) -> Tensor:
        """Clips (..., T, F), frames in order, to (..., T, F')."""
        rotations = matrix_from_rot6d(features[..., :-POSITION].unflatten(-1, (-1, ROT6D)))
        return torch.cat([self.of_matrices(rotations).flatten(-2), features[..., -POSITION:]], dim=-1)

    def decode(self, features: Tensor) -> Tensor:
        """(..., F') of any values to (..., F), differentiable."""
        rotations = self.to_matrices(features[..., :-POSITION].unflatten(-1, (-1, self.numbers)))
        return torch.cat([rot6d_from_matrix(rotations).flatten(-2), features[..., -POSITION:]], dim=-1)

    def of_matrices(self, rotations: Tensor) -> Tensor:
        """(..., T, J, 3, 3) to (..., T, J, numbers)."""
        raise NotImplementedError

    def to_matrices(self, rotations: Tensor) -> Tensor:
        """(..., J, numbers) of any values to (..., J, 3, 3)."""
        raise NotImplementedError

    def violation(self, rotations: Tensor) -> Tensor:
        """How far (..., J, numbers) of any values are from a rotation's, (..., J); 0 where all values are one."""
        return torch.zeros_like(rotations[..., 0])


class Matrix(RotationForm):
    """The nine entries, row by row; what a decoder gives is taken to the nearest rotation.

    By special orthogonal Procrustes (Levinson et al. 2020), which treats all nine alike: Gram-Schmidt would never look
    at the third column, so that a third of a decoder's output would learn nothing.
    """

    numbers: ClassVar[int] = 9

    def of_matrices(self, rotations: Tensor) -> Tensor:
        return rotations.flatten(-2)

    def to_matrices(self, rotations: Tensor) -> Tensor:
        # roma keeps a constant of its first call, which no later training could use if it were an inference tensor.
        with torch.inference_mode(False):
            return roma.special_procrustes(rotations.unflatten(-1, (3, 3)))

    def violation(self, rotations: Tensor) -> Tensor:
        """|R R^T - I|^2 + abs(det R - 1) (Ghorbani et al. 2020, Eq. 25 with c_1 = c_2 = 1)."""
        matrix = rotations.unflatten(-1, (3, 3))
        orthogonality = matrix @ matrix.transpose(-1, -2) - torch.eye(3).to(matrix)
        x, y, z = matrix.unbind(-1)
        determinant = (torch.linalg.cross(x, y) * z).sum(dim=-1)
        return orthogonality.square().sum(dim=(-1, -2)) + (determinant - 1).abs()


class Quaternion(RotationForm):
    """Quaternions in the order x, y, z, w, their signs continuous along a clip; decoding normalises them."""

    numbers: ClassVar[int] = 4

    def of_matrices(self, rotations: Tensor) -> Tensor:
        return continuous(roma.rotmat_to_unitquat(rotations))

    def to_matrices(self, rotations: Tensor) -> Tensor:
        return roma.unitquat_to_rotmat(F.normalize(rotations, dim=-1))

    def violation(self, rotations: Tensor) -> Tensor:
        """abs(|q|^2 - 1) (Ghorbani et al. 2020, Eq. 26)."""
        return (rotations.square().sum(dim=-1) - 1).abs()


class AxisAngle(RotationForm):
    """Rotation vectors in radians, continuous along a clip while no joint comes full circle.

    They start within half a turn and go on beyond it, up to a full one: a clip that were kept within half a turn would
    jump to the opposite vector there.
    """

    numbers: ClassVar[int] = 3

    def of_matrices(self, rotations: Tensor) -> Tensor:
        return roma.unitquat_to_rotvec(continuous(roma.rotmat_to_unitquat(rotations)), shortest_arc=False)

    def to_matrices(self, rotations: Tensor) -> Tensor:
        return roma.rotvec_to_rotmat(rotations)


def continuous(quaternions: Tensor) -> Tensor:
    """Of q and -q, which are one rotation, the one nearer to the frame before; w >= 0 at the first frame.

    Quaternions (..., T, J, 4) in the order x, y, z, w.
    """
    before, after = quaternions[..., :-1, :, :], quaternions[..., 1:, :, :]
    first = quaternions[..., :1, :, 3] < 0
    turned = torch.cat([first, (before * after).sum(dim=-1) < 0], dim=-2)  # against the frame before
    flipped = turned.cumsum(dim=-2) % 2 == 1
    return torch.where(flipped.unsqueeze(-1), -quaternions, quaternions)
