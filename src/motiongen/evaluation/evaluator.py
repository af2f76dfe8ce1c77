"""Judges systems, and the real clips, on the test split, under one recognizer or several."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence, Set
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any

import torch
from rich import get_console
from rich.progress import Progress
from torch import Tensor

from motiongen.contracts import Condition, MotionBatch
from motiongen.evaluation.archive import Archive, Entry
from motiongen.evaluation.judgement import Judge, Judgement
from motiongen.evaluation.leaks import LeakError, refuse_leaks
from motiongen.evaluation.lengths import Length, with_lengths
from motiongen.evaluation.protocol import Protocol
from motiongen.evaluation.results import REAL, Evaluation
from motiongen.evaluation.scoring import Scoring
from motiongen.recognition.recognizer import Recognizer, TrainedRecognizer

if TYPE_CHECKING:
    from motiongen.data.datamodule import MotionData

Generate = Callable[[Condition, int], Tensor]
"""Condition and seed to motion (B, T, 135): all that evaluation knows of a system."""


@dataclass(frozen=True)
class System:
    """What is judged."""

    generate: Generate
    """From a model in eval mode, on the recognizers' device."""
    fingerprint: str = ""
    """Of all that decides what it generates. What was measured of a system without one is not kept."""


@dataclass(frozen=True)
class Recorded:
    """Motions that exist already, with the action that each shows; no test clip is their counterpart."""

    batches: Sequence[MotionBatch]


@torch.inference_mode()
def evaluate(
    systems: Mapping[str, System | Recorded],
    data: MotionData,
    recognizers: Sequence[TrainedRecognizer],
    protocol: Protocol,
    archive: Archive | None = None,
) -> tuple[Evaluation, ...]:
    """Judge systems, and the real clips, on the test split: one evaluation a recognizer, of the same motions.

    Every system generates every test clip once a seed. A system's FID is against the real test clips; the real clips'
    own FID is against as many training clips, drawn anew for every seed. All other metrics of the real clips are the
    same functions on the real motion. Seeds that lie in the archive are not generated again. Where the protocol names
    lengths, the test clips' conditions are answered at each of them, too, with the same noise.

    Recorded motions are measured as they are. Where a figure compares a motion with the test clip that it was made for,
    they have none, and no difference from other systems.

    Args:
        systems: what is judged, by name; differences are taken from the first.
        data: whose test split is used.
        recognizers: trained on the same data's training split.
        protocol: seeds and settings.
        archive: where judgements of single seeds are kept.

    Raises:
        LeakError: a test clip lies in the training set, or a recognizer was trained on another split.
        ValueError: a system named "real", a tag without a test clip, or a system whose motion is not finite or of the
            wrong shape (with its name).
    """
    if REAL in systems:
        raise ValueError(f'the name "{REAL}" is kept for the real test clips')
    refuse_leaks(data)
    for recognizer in recognizers:
        _refuse_other_data(recognizer, data)
    device = next(recognizers[0].recognizer.parameters()).device
    batches = [batch.to(device) for batch in data.test_batches(protocol.batch_size)]
    tested = torch.cat([batch.condition.tags for batch in batches]).double().cpu()
    if absent := [tag for tag, count in zip(data.tags, tested.sum(dim=0).tolist(), strict=True) if not count]:
        raise ValueError(f"data {data.name}: no test clip shows {', '.join(absent)}; its figures would mean nothing")
    judges = [Judge.of(one.recognizer.eval(), data, batches, protocol.frozen_speed) for one in recognizers]
    widths = [features_of(one.recognizer, batches[:1]).shape[1] for one in recognizers]
    lengths = [Length.of(frames, batches, data, protocol.batch_size) for frames in protocol.lengths]
    # Drawn anew by a thread only where somebody watches.
    with Progress(auto_refresh=get_console().is_terminal) as progress:
        task = progress.add_task("Evaluating", total=len(systems) * protocol.seeds)
        runs: list[dict[str, list[Judgement]]] = [{name: [] for name in systems} for _ in judges]
        at_lengths: list[dict[str, list[list[Judgement]]]] = [{} for _ in judges]
        for name, system in systems.items():
            if isinstance(system, Recorded):
                for judge, own in zip(judges, runs, strict=True):
                    own[name] = [_recorded(judge, system, device)] * protocol.seeds
                progress.advance(task, protocol.seeds)
                continue
            for at_length in at_lengths:
                at_length[name] = [[] for _ in lengths]
            entries = [
                Entry(_key(system, data, recognizer, protocol), tested, width) if system.fingerprint else None
                for recognizer, width in zip(recognizers, widths, strict=True)
            ]
            for seed in protocol.generation_seeds:
                try:
                    found = _judged(system, seed, batches, judges, entries, archive)
                    for own, judgement in zip(runs, found, strict=True):
                        own[name].append(judgement)
                    for number, length in enumerate(lengths):
                        named = [entry.of(length.frames) if entry else None for entry in entries]
                        found = _judged(system, seed, length.conditions, judges, named, archive)
                        for at_length, judgement in zip(at_lengths, found, strict=True):
                            at_length[name][number].append(judgement)
                except ValueError as error:
                    raise ValueError(f"system {name}, seed {seed}: {error}") from error
                progress.advance(task)
    paired = {name for name, system in systems.items() if isinstance(system, System)}
    return tuple(
        with_lengths(_evaluation(judge, recognizer, own, paired, batches, data, protocol), judge, lengths, at_length)
        for judge, recognizer, own, at_length in zip(judges, recognizers, runs, at_lengths, strict=True)
    )


def _refuse_other_data(recognizer: TrainedRecognizer, data: MotionData) -> None:
    if recognizer.data_fingerprint != data.fingerprint:
        raise LeakError(
            f"the recognizer {recognizer.fingerprint[:12]} was trained on other data or another split "
            f"({recognizer.data_fingerprint[:12]}) than is tested ({data.fingerprint[:12]}): it may know the test clips"
        )


def _key(system: System, data: MotionData, recognizer: TrainedRecognizer, protocol: Protocol) -> tuple[Any, ...]:
    """All that a seed's judgement depends on, besides the seed."""
    settings = {name: asdict(protocol)[name] for name in ("batch_size", "frozen_speed")}
    return system.fingerprint, data.fingerprint, recognizer.fingerprint, settings


def _judged(
    system: System,
    seed: int,
    asked: Sequence[MotionBatch | Condition],
    judges: Sequence[Judge],
    entries: Sequence[Entry | None],
    archive: Archive | None,
) -> list[Judgement]:
    """One seed's motions of all test clips before every judge; from the archive where they lie there for all judges.

    They are measured against those of the batches, or by themselves where only conditions are given.
    """
    kept = [archive.load(entry.of(seed)) if archive and entry else None for entry in entries]
    known = [judgement for judgement in kept if judgement is not None]
    if len(known) == len(judges):
        return known
    parts: list[list[Judgement]] = [[] for _ in judges]
    for index, one in enumerate(asked):
        condition = one.condition if isinstance(one, MotionBatch) else one
        # Neither batches nor seeds may share their noise: every pair of the two has a number of its own.
        motion = system.generate(condition, seed * len(asked) + index)
        for judge, own in zip(judges, parts, strict=True):
            own.append(judge(motion, one) if isinstance(one, MotionBatch) else judge.alone(motion, one))
    found = [Judgement.concatenate(own) for own in parts]
    for entry, judgement in zip(entries, found, strict=True):
        if archive and entry:
            archive.save(entry.of(seed), judgement)
    return found


def _recorded(judge: Judge, system: Recorded, device: torch.device) -> Judgement:
    batches = [batch.to(device) for batch in system.batches]
    judged = Judgement.concatenate(judge.alone(batch.motion, batch.condition) for batch in batches)
    return replace(judged, trajectory_error=torch.full_like(judged.trajectory_error, torch.nan))


def _evaluation(
    judge: Judge,
    recognizer: TrainedRecognizer,
    runs: Mapping[str, Sequence[Judgement]],
    paired: Set[str],
    batches: Sequence[MotionBatch],
    data: MotionData,
    protocol: Protocol,
) -> Evaluation:
    """Everything under one recognizer. `paired`: the systems whose clips stand for the test clips, in their order."""
    real = Judgement.concatenate(judge(batch.motion, batch) for batch in batches)
    # Cut into windows as the test clips are.
    training = features_of(judge.recognizer, data.train_windows(protocol.batch_size))
    scoring = Scoring(real, training, data.test_takes(), data.tags, protocol)
    first = next((name for name in runs if name in paired), None)
    results = {REAL: scoring.real_clips(runs[first] if first else None)}
    for name, seeds in runs.items():
        if name in paired:
            results[name] = scoring.paired(seeds, runs[first] if first and name != first else None)
        else:
            results[name] = scoring.unpaired(seeds)
    return Evaluation(
        protocol=protocol,
        systems=results,
        count=len(real),
        real_fid_count=scoring.drawn,
        takes=scoring.take_count,
        data_fingerprint=data.fingerprint,
        recognizer=type(recognizer.recognizer).__name__,
        feature_width=real.features.shape[1],
        recognizer_fingerprint=recognizer.fingerprint,
        recognizer_accuracy=recognizer.test_accuracy,
    )


@torch.inference_mode()
def features_of(network: Recognizer, batches: Iterable[MotionBatch]) -> Tensor:
    """(M, E) float64 features of the real clips of these batches, on the CPU."""
    device = next(network.parameters()).device
    moved = (batch.to(device) for batch in batches)
    return torch.cat([network(batch.motion, batch.condition.mask).features for batch in moved]).double().cpu()
