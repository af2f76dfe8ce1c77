"""`task=evaluate`: judge the generator of a run again (`run=...`), or motions that others made (`motions=...`)."""

from __future__ import annotations

from pathlib import Path

from omegaconf import DictConfig

from motiongen.data.datamodule import MotionData
from motiongen.data.sources.folder import MotionFolder
from motiongen.evaluation.evaluator import Recorded
from motiongen.evaluation.leaks import refuse_trained_clips
from motiongen.evaluation.results import Evaluation
from motiongen.tasks.assembly import build_data, run_folder, trained_generator
from motiongen.tasks.judging import judge, judge_systems
from motiongen.tasks.record import Record


def run(config: DictConfig) -> None:
    """Evaluate; the figures lie in a run folder of their own and in the tracker."""
    with Record(config, run_folder()) as record:
        data = build_data(config)
        record.data(data)
        record.evaluation(judge_run(config, data) if config.motions is None else judge_folder(config, data))
    record.print_outcome()


def judge_run(config: DictConfig, data: MotionData) -> tuple[Evaluation, ...]:
    """The generator of `config.run`.

    Raises:
        LeakError: it was trained on test clips of this data.
    """
    generator, trained_on = trained_generator(config, data)
    refuse_trained_clips(trained_on, data)
    return judge(config, data, generator)


def judge_folder(config: DictConfig, data: MotionData) -> tuple[Evaluation, ...]:
    """The motions in the folder `config.motions`, on the body of the data."""
    source = MotionFolder(root=config.motions, skeleton=data.skeleton)
    batches = data.outside(source, Path(config.cache), config.evaluation.batch_size)
    return judge_systems(config, data, {"motions": Recorded(batches)})
