"""From what was measured on every clip to what a system scored: figures, intervals, differences, actions."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from motiongen.evaluation.figures import clip_values, metrics
from motiongen.evaluation.judgement import Judgement
from motiongen.evaluation.metrics.classification import class_accuracy
from motiongen.evaluation.metrics.frechet import frechet_distance
from motiongen.evaluation.protocol import Protocol
from motiongen.evaluation.results import ActionResult, SystemResult
from motiongen.evaluation.uncertainty import Interval, bootstrap, jackknife


@dataclass(frozen=True)
class Scoring:
    """Scores systems under one recognizer. A system comes as its judgements, one a generation seed."""

    real: Judgement
    """Of the test clips."""
    training: Tensor
    """(M, E) features of all training clips."""
    takes: Tensor
    """(N,) which take each test clip was cut from, numbered from 0."""
    tags: tuple[str, ...]
    """Names of the columns of tag vectors."""
    protocol: Protocol

    @property
    def drawn(self) -> int:
        """Training clips that the real clips' own FID is taken against."""
        return min(len(self.real), len(self.training))

    @property
    def take_count(self) -> int:
        return int(self.takes.max()) + 1

    def real_clips(self, first: Sequence[Judgement] | None) -> SystemResult:
        """The test clips themselves, and their differences from the first system, where there is one."""
        values = []
        for seed in self.protocol.generation_seeds:
            chosen = torch.randperm(len(self.training), generator=_generator(seed))[: self.drawn]
            values.append(metrics(self.real, self.training[chosen], self.training, seed, self.protocol))
        means = clip_values(self.real)
        differences = self._intervals(_apart(means, _seed_means(first)), self.takes) if first else {}
        return self._result([self.real], values, self._intervals(means, self.takes), differences)

    def paired(self, seeds: Sequence[Judgement], first: Sequence[Judgement] | None) -> SystemResult:
        """A system that answered every test clip's condition, and its differences from the first, if it is not that."""
        means, groups = _seed_means(seeds), self.protocol.jackknife_groups
        clips = self._intervals(means, self.takes)
        clips["fid"] = jackknife(self._fid(seeds), self.takes, groups)
        differences = {}
        if first:
            own, other = self._fid(seeds), self._fid(first)
            differences = self._intervals(_apart(means, _seed_means(first)), self.takes)
            differences["fid"] = jackknife(lambda kept: own(kept) - other(kept), self.takes, groups)
        return self._result(seeds, self._metrics(seeds), clips, differences)

    def unpaired(self, seeds: Sequence[Judgement]) -> SystemResult:
        """Motions that no test clip is the counterpart of; each counts as a take of its own."""
        clips = self._intervals(_seed_means(seeds), torch.arange(len(seeds[0])))
        return self._result(seeds, self._metrics(seeds), clips, {})

    def _result(
        self,
        seeds: Sequence[Judgement],
        values: list[dict[str, float]],
        clips: dict[str, Interval],
        differences: dict[str, Interval],
    ) -> SystemResult:
        by_metric = {metric: tuple(one[metric] for one in values) for metric in values[0]}
        actions = action_results(Judgement.concatenate(seeds), self.real, self.tags)
        return SystemResult(len(seeds[0]), by_metric, actions, clips, differences)

    def _metrics(self, seeds: Sequence[Judgement]) -> list[dict[str, float]]:
        numbered = zip(seeds, self.protocol.generation_seeds, strict=True)
        return [metrics(run, self.real.features, self.training, seed, self.protocol) for run, seed in numbered]

    def _intervals(self, values: Mapping[str, Tensor], takes: Tensor) -> dict[str, Interval]:
        # The same takes are drawn for every metric and system.
        first_seed, draws = self.protocol.first_seed, self.protocol.bootstrap_draws
        return {metric: bootstrap(clips, takes, draws, _generator(first_seed)) for metric, clips in values.items()}

    def _fid(self, seeds: Sequence[Judgement]) -> Callable[[Tensor], float]:
        """The FID of the clips that a mask keeps, mean over seeds."""
        real = self.real.features
        return lambda kept: sum(frechet_distance(run.features[kept], real[kept]) for run in seeds) / len(seeds)


def _seed_means(seeds: Sequence[Judgement]) -> dict[str, Tensor]:
    """What every clip scored on average over seeds: name to (N,)."""
    values = [clip_values(run) for run in seeds]
    return {metric: torch.stack([one[metric] for one in values]).nanmean(dim=0) for metric in values[0]}


def _apart(one: Mapping[str, Tensor], other: Mapping[str, Tensor]) -> dict[str, Tensor]:
    return {metric: values - other[metric] for metric, values in one.items()}


def action_results(judged: Judgement, real: Judgement, tags: tuple[str, ...]) -> dict[str, ActionResult]:
    """What the clips of every tag scored, beside the real clips of that tag; tags without a test clip are left out."""
    right = class_accuracy(judged.logits, judged.tags)
    speed, real_speed = _tag_means(judged.joint_speed, judged.tags), _tag_means(real.joint_speed, real.tags)
    skating, real_skating = _tag_means(judged.foot_skating, judged.tags), _tag_means(real.foot_skating, real.tags)
    counts = (real.tags > 0).sum(dim=0)
    return {
        tag: ActionResult(
            count=int(counts[column]),
            accuracy=float(right[column]),
            joint_speed=float(speed[column]),
            speed_ratio=float(speed[column] / real_speed[column]),
            foot_skating=float(skating[column]),
            skating_ratio=float(skating[column] / real_skating[column]),
        )
        for column, tag in enumerate(tags)
        if counts[column]
    }


def _tag_means(values: Tensor, tags: Tensor) -> Tensor:
    """Mean of (N,) over the clips of every tag (N, A), NaN clips left out: (A,)."""
    return torch.stack([values[column > 0].nanmean() for column in tags.T])


def _generator(seed: int) -> torch.Generator:
    return torch.Generator().manual_seed(seed)
