"""How fast long motions are made, how much memory that takes, and whether a frame costs more later in a motion.

    python benchmarks/synthesis.py [--batches 1 16 128] [--actions 20] [--frames 60] [--lengths 5 20 80] [--scale small]

MARIONET as `scale` has it with its first weights, on random initial poses: nothing here depends on what it learned.
Every batch is made in a process of its own, after one action that warms up; its peak memory is printed beside that of
one which only builds the generator. `OMP_NUM_THREADS` decides the threads.
"""

from __future__ import annotations

import argparse
import multiprocessing
import resource
import time

import torch

from motiongen.configuration import compose
from motiongen.data.clips import INITIAL_FRAMES
from motiongen.evaluation.table import markdown
from motiongen.motion.representation import FEATURES, pack
from motiongen.motion.skeleton import JOINTS
from motiongen.synthesis.paths import RecordedPath
from motiongen.synthesis.pipeline import Plan, Step, synthesize

TAGS = 18


def measured(scale: str, batch: int, actions: int, frames: int) -> tuple[float, float]:
    """Seconds to make `batch` motions of `actions` actions of `frames` frames, and the process' peak memory in MiB."""
    from hydra.utils import instantiate

    torch.manual_seed(0)
    config = compose(["+experiment=marionette", f"scale={scale}"])
    generator = instantiate(config.generator)(features=FEATURES, tags=TAGS, initial_frames=INITIAL_FRAMES, styles=0)
    poses = pack(torch.eye(3).expand(INITIAL_FRAMES, JOINTS, 3, 3), torch.tensor([0.0, 0.0, 0.9]).expand(6, 3))
    path = RecordedPath(torch.stack([torch.zeros(frames), -0.03 * torch.arange(1, frames + 1)], dim=-1))
    steps = [Step(torch.eye(TAGS)[number % TAGS], frames, path if number % 2 else None) for number in range(actions)]
    generator.eval()
    if batch:
        synthesize(generator, [Plan(poses, steps[:1])], seed=0)
    start = time.perf_counter()
    if batch:
        synthesize(generator, [Plan(poses, steps)] * batch, seed=0)
    taken = time.perf_counter() - start
    return taken, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def alone(*arguments: object) -> tuple[float, float]:
    """`measured` in a fresh process."""
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        return pool.apply(measured, arguments)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--batches", type=int, nargs="+", default=[1, 16, 128])
    parser.add_argument("--actions", type=int, default=20)
    parser.add_argument("--frames", type=int, default=60)
    parser.add_argument("--lengths", type=int, nargs="+", default=[5, 20, 80])
    parser.add_argument("--scale", default="small")
    options = parser.parse_args()
    _, idle = alone(options.scale, 0, 1, options.frames)
    rows = []
    for batch in options.batches:
        taken, memory = alone(options.scale, batch, options.actions, options.frames)
        made = batch * options.actions * options.frames
        rows.append(
            {
                "motions at once": str(batch),
                "seconds": f"{taken:.2f}",
                "motions / s": f"{batch / taken:.2f}",
                "frames / s": f"{made / taken:.0f}",
                "memory (MiB)": f"{memory:.0f} ({memory - idle:.0f} above building the generator)",
            }
        )
    print(f"{options.actions} actions of {options.frames} frames, scale={options.scale}\n")
    print(markdown(rows), end="\n\n")
    rows = []
    for actions in options.lengths:
        taken, _ = alone(options.scale, 1, actions, options.frames)
        cost = 1000 * taken / (actions * options.frames)
        rows.append({"actions": str(actions), "seconds": f"{taken:.2f}", "ms / frame": f"{cost:.2f}"})
    print(markdown(rows))


if __name__ == "__main__":
    main()
