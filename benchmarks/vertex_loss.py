"""The vertex loss by its factored Gram matrix beside skinning every vertex: time and peak memory.

    python benchmarks/vertex_loss.py [--poses 1200] [--vertices 6890] [--repeats 5]

Each way runs forward and backward in a process of its own, on as many threads as torch chooses; OMP_NUM_THREADS=1 asks
for one. Memory is what the process needs above what it held before the first loss.
"""

from __future__ import annotations

import argparse
import multiprocessing
import resource
import statistics
import time
from dataclasses import dataclass, replace

import roma
import torch
from torch import Tensor

from motiongen.motion.bodies import Body, makehuman
from motiongen.motion.representation import pack
from motiongen.motion.skeleton import JOINTS
from motiongen.objectives.vertices import DirectSkinning, FactoredSkinning, Vertices


@dataclass(frozen=True)
class Measurement:
    seconds: float
    """of one loss with its gradient: the median"""
    mebibytes: float
    """peak above what was held before"""
    loss: float
    gradient: Tensor


def body_of(vertices: int) -> Body:
    """The built-in body, cut to a number of vertices (SMPL has 6,890)."""
    body = makehuman()
    return replace(body, rest=body.rest[:vertices], weights=body.weights[:vertices])


def poses(count: int, seed: int) -> Tensor:
    generator = torch.Generator().manual_seed(seed)
    rotations = roma.rotvec_to_rotmat(0.5 * torch.randn(count, JOINTS, 3, generator=generator))
    return pack(rotations, torch.randn(count, 3, generator=generator))


def measure(direct: bool, count: int, vertices: int, repeats: int) -> Measurement:
    body = body_of(vertices)
    quantity = Vertices(body=body)
    quantity.skinning = DirectSkinning if direct else FactoredSkinning
    predicted, target = poses(count, 0).requires_grad_(), poses(count, 1)
    quantity(target[:2], body.skeleton)  # fit the body and factor its Gram matrix, which is done once in a run
    held = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    seconds = []
    for _ in range(repeats):
        started = time.perf_counter()
        loss = (quantity(predicted, body.skeleton) - quantity(target, body.skeleton)).square().mean()
        (gradient,) = torch.autograd.grad(loss, predicted)
        seconds.append(time.perf_counter() - started)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - held
    return Measurement(statistics.median(seconds), peak / 1024, loss.item(), gradient)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--poses", type=int, default=1200)
    parser.add_argument("--vertices", type=int, default=6890)
    parser.add_argument("--repeats", type=int, default=5)
    options = parser.parse_args()
    found = {}
    for direct in (True, False):
        with multiprocessing.get_context("spawn").Pool(1) as pool:
            found[direct] = pool.apply(measure, (direct, options.poses, options.vertices, options.repeats))
    direct, factored = found[True], found[False]
    print(f"{options.poses} poses, {options.vertices} vertices, float32, loss and gradient")
    for name, one in (("skinning", direct), ("factored", factored)):
        print(f"  {name}: {1e3 * one.seconds:9.1f} ms, {one.mebibytes:8.1f} MiB, loss {one.loss:.8f}")
    error = (factored.gradient - direct.gradient).norm() / direct.gradient.norm()
    print(f"  relative error: loss {abs(factored.loss / direct.loss - 1):.1e}, gradient {error:.1e}")
    time_ratio, memory_ratio = direct.seconds / factored.seconds, direct.mebibytes / max(factored.mebibytes, 1)
    print(f"  {time_ratio:.0f} times faster, with {memory_ratio:.0f} times less memory")


if __name__ == "__main__":
    main()
