"""Where the time of an evaluation goes, for 1,000 and 10,000 motions; the FID's root beside scipy's.

    python benchmarks/evaluation.py [--motions 1000 10000] [--frames 60] [--features 64] [--repeats 5]

Motions are random poses: nothing here depends on what they show. Each step runs `--repeats` times; medians are printed.
The recognizer is the default one. `OMP_NUM_THREADS` decides the threads.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable

import roma
import scipy.linalg
import torch
from torch import Tensor

from motiongen.evaluation.metrics.coverage import density_coverage, precision_recall
from motiongen.evaluation.metrics.frechet import frechet_distance
from motiongen.evaluation.metrics.kernel import kernel_distance
from motiongen.evaluation.metrics.memorization import nearest_training_distance
from motiongen.evaluation.metrics.motion import foot_skating, joint_speed, resting_heights
from motiongen.evaluation.metrics.physics import mean_jerk
from motiongen.evaluation.metrics.spread import diversity, expected_diversity, multimodality
from motiongen.evaluation.table import markdown
from motiongen.motion.bodies import makehuman
from motiongen.motion.kinematics import joint_positions
from motiongen.motion.representation import pack
from motiongen.motion.skeleton import JOINTS
from motiongen.recognition.transformer import TransformerRecognizer

TAGS = 18
BATCH = 64


def scipy_frechet_distance(first: Tensor, second: Tensor) -> float:
    """The form of the public scripts: scipy's root of the product of the covariances."""
    one, other = torch.cov(first.T).numpy(), torch.cov(second.T).numpy()
    root = scipy.linalg.sqrtm(one @ other).real
    apart = (first.mean(0) - second.mean(0)).square().sum()
    return float(apart + one.trace() + other.trace() - 2 * root.trace())


def seconds(action: Callable[[], object], repeats: int) -> float:
    """Median wall time."""
    found = []
    for _ in range(repeats):
        start = time.perf_counter()
        action()
        found.append(time.perf_counter() - start)
    return statistics.median(found)


def steps(count: int, frames: int, width: int) -> dict[str, Callable[[], object]]:
    """What an evaluation does with `count` motions, by name."""
    draws = torch.Generator().manual_seed(0)
    skeleton = makehuman().skeleton
    batch = min(BATCH, count)
    turns = 0.3 * torch.randn(batch, frames, JOINTS, 3, generator=draws)
    motion = pack(roma.rotvec_to_rotmat(turns), torch.randn(batch, frames, 3, generator=draws))
    mask = torch.ones(batch, frames, dtype=torch.bool)
    joints = joint_positions(motion, skeleton)
    resting = resting_heights(joints, mask)
    network = TransformerRecognizer(tags=TAGS, skeleton=skeleton, feature_width=width).eval()
    features, real = (torch.randn(count, width, generator=draws, dtype=torch.float64) for _ in range(2))
    tags = torch.eye(TAGS)[torch.arange(count) % TAGS]
    rounds = range(-(-count // batch))

    def recognition() -> None:
        with torch.inference_mode():
            for _ in rounds:
                network(motion, mask)

    def movement() -> None:
        with torch.inference_mode():
            for _ in rounds:
                found = joint_positions(motion, skeleton)
                joint_speed(found, mask), foot_skating(found, mask, resting), mean_jerk(found, mask)

    return {
        "recognizer": recognition,
        "kinematics, speed, skating, jerk": movement,
        "FID": lambda: frechet_distance(features, real),
        "FID, scipy.linalg.sqrtm": lambda: scipy_frechet_distance(features, real),
        "KID": lambda: kernel_distance(features, real),
        "precision, recall": lambda: precision_recall(real, features, 3),
        "density, coverage": lambda: density_coverage(real, features, 5),
        "diversity, multimodality": lambda: (diversity(features, draws, 200), multimodality(features, tags, draws, 20)),
        "diversity, expected": lambda: expected_diversity(features),
        "nearest training clip": lambda: nearest_training_distance(features, real),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--motions", type=int, nargs="+", default=[1000, 10000])
    parser.add_argument("--frames", type=int, default=60)
    parser.add_argument("--features", type=int, default=64)
    parser.add_argument("--repeats", type=int, default=5)
    options = parser.parse_args()
    rows: dict[str, dict[str, str]] = {}
    for count in options.motions:
        for name, step in steps(count, options.frames, options.features).items():
            taken = seconds(step, options.repeats)
            rows.setdefault(name, {"step": name})[f"{count} motions (s)"] = f"{taken:.4f}"
    print(f"{options.frames} frames, {options.features} features, {torch.get_num_threads()} threads\n")
    print(markdown(list(rows.values())))


if __name__ == "__main__":
    main()
