"""`task=long_motion runs=[...]`: long motions of several generators, with and without corrections, in one table."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import torch
from hydra.utils import instantiate
from omegaconf import DictConfig
from torch import Tensor

from motiongen.contracts import CompositionError
from motiongen.data.clips import INITIAL_FRAMES
from motiongen.data.datamodule import MotionData
from motiongen.data.dataset import Item
from motiongen.evaluation.evaluator import features_of
from motiongen.evaluation.judgement import Judge
from motiongen.evaluation.long_motion import Act, acts_of, judge_acts
from motiongen.evaluation.long_results import LongResult, summarized
from motiongen.evaluation.results import REAL
from motiongen.evaluation.sequences import (
    SequenceProtocol,
    draw_sequences,
    plausible_transitions,
    recorded_transitions,
)
from motiongen.recognition.cache import obtain_recognizer
from motiongen.recognition.recognizer import TrainedRecognizer
from motiongen.synthesis.correction import Correction
from motiongen.synthesis.floor import Floor
from motiongen.synthesis.paths import RecordedPath
from motiongen.synthesis.pipeline import Plan, Step, synthesize
from motiongen.tasks.assembly import build_data, run_folder
from motiongen.tasks.record import Record
from motiongen.tasks.trained import TrainedRun, grouped, trained_runs

_log = logging.getLogger(__name__)


def run(config: DictConfig) -> None:
    """Judge the runs' long motions; a table for each kind of sequences, and curves along them."""
    with Record(config, run_folder()) as record:
        data = build_data(config)
        record.data(data)
        protocol: SequenceProtocol = instantiate(config.sequences)
        runs = trained_runs(config.runs, data, trust=config.trust)
        corrections: dict[str, Correction] = {name: instantiate(one) for name, one in config.corrections.items()}
        settings = [one for one in (config.recognizer, config.second_recognizer) if one is not None]
        recognizers = [obtain_recognizer(one, data, Path(config.cache)) for one in settings]
        stage = Stage.of(data, protocol, recognizers, config.evaluation)
        for kind in protocol.kinds:
            groups = {
                f"{composition}, {correction}": [f"{name}, {correction}" for name in names]
                for composition, names in grouped(runs).items()
                for correction in corrections
            }
            record.long_motion(kind, stage.judged(kind, runs, corrections), groups, asdict(protocol), recognizers)
    record.print_outcome()


@dataclass(frozen=True)
class Stage:
    """What all systems are judged on."""

    data: MotionData
    protocol: SequenceProtocol
    clips: Sequence[Item]
    """The test clips to choose from, whole"""
    transitions: Tensor
    judges: Sequence[Judge]
    references: Sequence[Tensor]
    """Features of the real test clips before every judge"""
    longest: int
    floor: Floor | None

    @classmethod
    def of(
        cls,
        data: MotionData,
        protocol: SequenceProtocol,
        recognizers: Sequence[TrainedRecognizer],
        evaluation: DictConfig,
    ) -> Stage:
        batches = list(data.test_batches(evaluation.batch_size))
        judges = [Judge.of(one.recognizer, data, batches, evaluation.frozen_speed) for one in recognizers]
        longest = max(batch.motion.shape[1] for batch in batches)
        clips = data.test_clips()
        items = [clips[number] for number in range(len(clips))]
        acts = [Act(number, 0, item.tags, item.initial_motion, item.motion) for number, item in enumerate(items)]
        seen = judge_acts(acts, judges[0], longest).logits.softmax(dim=-1)
        sure = (seen * torch.stack([item.tags for item in items])).sum(dim=-1) >= protocol.confidence
        items = [item for item, is_sure in zip(items, sure.tolist(), strict=True) if is_sure]
        transitions = recorded_transitions(data)
        if not transitions.any():
            transitions = plausible_transitions(data, protocol.plausible_within)
            _log.info("no transitions are recorded: an action may follow where its poses are near enough")
        references = [features_of(judge.recognizer, batches) for judge in judges]
        floor = Floor.of(data) if protocol.floor else None
        return cls(data, protocol, items, transitions, judges, references, longest, floor)

    def judged(
        self, kind: str, runs: Sequence[TrainedRun], corrections: Mapping[str, Correction]
    ) -> list[dict[str, LongResult]]:
        """Every system's figures before each judge; the real clips of the sequences come first."""
        chains = draw_sequences(
            kind,
            self.transitions,
            torch.stack([item.tags for item in self.clips]),
            torch.stack([item.next_tags for item in self.clips]),
            count=self.protocol.count,
            actions=self.protocol.actions,
            seed=self.protocol.seed,
        )
        results: list[dict[str, LongResult]] = [{} for _ in self.judges]
        for name, acts in self._systems(chains, runs, corrections):
            for judge, reference, found in zip(self.judges, self.references, results, strict=True):
                found[name] = summarized(judge_acts(acts, judge, self.longest), reference)
        return results

    def _systems(
        self, chains: Sequence[Sequence[int]], runs: Sequence[TrainedRun], corrections: Mapping[str, Correction]
    ) -> Iterator[tuple[str, list[Act]]]:
        yield (
            REAL,
            [
                Act(sequence, index, self.clips[clip].tags, self.clips[clip].initial_motion, self.clips[clip].motion)
                for sequence, chain in enumerate(chains)
                for index, clip in enumerate(chain)
            ],
        )
        plans = [self._plan([self.clips[clip] for clip in chain]) for chain in chains]
        tags = [[step.tags for step in plan.steps] for plan in plans]
        for run in runs:
            for name, correction in corrections.items():
                try:
                    motions = synthesize(
                        run.generator,
                        plans,
                        self.protocol.seed,
                        correction=correction,
                        recognizer=self.judges[0].recognizer,
                        longest=self.longest,
                        smooth=self.protocol.smooth,
                        floor=self.floor,
                    )
                except CompositionError as error:
                    _log.warning("%s is not made with %s: %s", run.name, name, error)
                    continue
                yield f"{run.name}, {name}", list(acts_of(motions, tags, INITIAL_FRAMES))

    def _plan(self, items: Sequence[Item]) -> Plan:
        steps = [
            Step(item.tags, len(item.motion), RecordedPath(item.trajectory) if item.trajectory.any() else None)
            for item in items
        ]
        return Plan(items[0].initial_motion, steps, items[0].styles)
