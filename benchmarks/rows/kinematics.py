"""Forward kinematics from local rotations to joints: 22 joints, 1,200 poses.

Reference: the joint loop over 4 x 4 matrices of smplx's `batch_rigid_transform`. Compiled is ours by
`torch.compile`, as it is within a vertex loss that is compiled.
"""

from __future__ import annotations

from functools import partial

import roma
import torch
from torch import Tensor

from benchmarks.measuring import Effort, interleaved
from benchmarks.reference.kinematics import posed_joints
from benchmarks.results import Comparison, Result, relative_error
from benchmarks.subjects import body
from motiongen.motion.kinematics import forward_kinematics
from motiongen.motion.skeleton import JOINTS, Skeleton

TITLE = "Forward kinematics, 22 joints, 1,200 poses"
TARGET = 5.0


def plain(rotations: Tensor) -> Tensor:
    return posed_joints(rotations, body(1).rest_joints)


def posed(rotations: Tensor, skeleton: Skeleton) -> Tensor:
    return forward_kinematics(rotations, rotations.new_zeros(len(rotations), 3), skeleton)[1]


def gradient(way, rotations: Tensor) -> Tensor:
    return torch.autograd.grad(way(rotations).square().sum(), rotations)[0]


def measure(effort: Effort) -> list[Result]:
    draws = torch.Generator().manual_seed(0)
    rotations = roma.rotvec_to_rotmat(torch.randn(effort.size(1200, 3), JOINTS, 3, generator=draws)).requires_grad_()
    ours = partial(posed, skeleton=body(1).skeleton)
    compiled = torch.compile(ours, dynamic=True)
    found: list[Result] = []
    for name, ways in (
        ("forward", {"reference": torch.no_grad()(plain), "ours": torch.no_grad()(ours)}),
        ("forward and backward", {"reference": partial(gradient, plain), "ours": partial(gradient, ours)}),
        (
            "forward and backward, compiled",
            {"reference": partial(gradient, plain), "ours": partial(gradient, compiled)},
        ),
    ):
        calls = {key: partial(way, rotations) for key, way in ways.items()}
        found.append(
            Comparison(
                name,
                # Before it is timed, so that compiling is over by then.
                error=relative_error(calls["ours"](), calls["reference"]()),
                **interleaved({key: partial(_repeat, call, effort.size(20, 1)) for key, call in calls.items()}, effort),
                tolerance=1e-5,
                target=TARGET,
                made=(effort.size(20, 1) * len(rotations), "poses"),
            )
        )
    return found


def _repeat(call, times: int) -> None:
    """A call of a millisecond is too short for one reading of the clock."""
    for _ in range(times):
        call()
