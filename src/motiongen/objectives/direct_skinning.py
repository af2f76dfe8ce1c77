"""Skinning of every vertex, pose-dependent correctives included: `Body.vertices` with the poses last, in parts."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import torch
from torch import Tensor

from motiongen.motion.bodies.body import Body

TOGETHER = 2**16
"""Vertices times poses that are skinned at once: what is worked out for them stays in the processor's cache."""


class Bones(NamedTuple):
    """N poses, as vertices follow them."""

    columns: Tensor
    """(3, 22, 3N): the columns of the joints' world rotations."""
    shift: Tensor
    """(22, 3N): where each joint takes the rest pose's origin, metres."""
    bent: Tensor
    """(189, N): the local rotations but the pelvis', less the identity, which correctives follow."""


class Flesh(NamedTuple):
    """Some vertices of a body."""

    weights: Tensor
    """(V, 22), of skinning."""
    rest: Tensor
    """(V, 3), metres."""
    directions: Tensor | None
    """(V, 3, 189), of the correctives, if the body has any."""

    def some(self, chosen: slice | Tensor) -> Flesh:
        directions = None if self.directions is None else self.directions[chosen]
        return Flesh(self.weights[chosen], self.rest[chosen], directions)

    def parts(self, poses: int) -> Iterator[Flesh]:
        """Some vertices after others, so many as are skinned at once for that many poses."""
        size = max(1, TOGETHER // max(1, poses))
        for start in range(0, len(self.rest), size):
            yield self.some(slice(start, start + size))


def flesh(body: Body) -> Flesh:
    """All vertices of a body."""
    return Flesh(body.weights, body.rest, body.pose_directions)


def bones(body: Body, rotations: Tensor, position: Tensor) -> Bones:
    """Local rotations (N, 22, 3, 3) and positions (N, 3) of the pelvis, metres."""
    world, moved = body.transforms(rotations, position)
    bent = rotations[:, 1:] - torch.eye(3).to(rotations)
    return Bones(
        columns=world.permute(3, 1, 2, 0).flatten(2),
        shift=moved.permute(1, 2, 0).flatten(1),
        bent=bent.flatten(1).T.contiguous(),
    )


def skinned(flesh: Flesh, bones: Bones) -> Tensor:
    """The vertices, (V, 3, N), metres."""
    place = flesh.rest.unsqueeze(-1)
    if flesh.directions is not None:
        place = place + _offsets(flesh.directions, bones)
    return _shift(flesh, bones) + _turned(_turns(flesh, bones), place)


def squared_error(flesh: Flesh, made: Bones, wanted: Bones) -> Tensor:
    """The squared distances of two poses' vertices, added up: (N,), square metres."""
    return (skinned(flesh, made) - skinned(flesh, wanted)).square().sum(dim=(0, 1))


def error_by_correctives(flesh: Flesh, made: Bones, wanted: Bones) -> Tensor:
    """What correctives add to `squared_error`: (N,), square metres.

    With du the difference of the vertices without them and dc that of what they add, |du + dc|^2 - |du|^2.
    """
    assert flesh.directions is not None
    (u, c), (other_u, other_c) = (_rigid_and_corrective(flesh, flesh.directions, bones) for bones in (made, wanted))
    change = c - other_c
    return ((2 * (u - other_u) + change) * change).sum(dim=(0, 1))


def _rigid_and_corrective(flesh: Flesh, directions: Tensor, bones: Bones) -> tuple[Tensor, Tensor]:
    turns = _turns(flesh, bones)
    rigid = _shift(flesh, bones) + _turned(turns, flesh.rest.unsqueeze(-1))
    return rigid, _turned(turns, _offsets(directions, bones))


def _shift(flesh: Flesh, bones: Bones) -> Tensor:
    """The blended translations, (V, 3, N)."""
    return (flesh.weights @ bones.shift).unflatten(-1, (3, -1))


def _turns(flesh: Flesh, bones: Bones) -> Tensor:
    """The columns of the blended rotations, (3, V, 3, N)."""
    return (flesh.weights @ bones.columns).unflatten(-1, (3, -1))


def _turned(turns: Tensor, place: Tensor) -> Tensor:
    """Blended rotations times places (V, 3, N or 1): (V, 3, N)."""
    x, y, z = place.unsqueeze(2).unbind(dim=1)
    return torch.addcmul(torch.addcmul(turns[0] * x, turns[1], y), turns[2], z)


def _offsets(directions: Tensor, bones: Bones) -> Tensor:
    """What correctives add to places in the rest pose, (V, 3, N), metres."""
    return (directions.flatten(0, 1) @ bones.bent).unflatten(0, (-1, 3))
