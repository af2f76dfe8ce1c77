"""`task=evaluate run=...`: judge the generator of a run again."""

from __future__ import annotations

from omegaconf import DictConfig

from motiongen.evaluation.leaks import refuse_trained_clips
from motiongen.tasks.assembly import build_data, run_folder, trained_generator
from motiongen.tasks.judging import judge
from motiongen.tasks.record import Record


def run(config: DictConfig) -> None:
    """Evaluate; the figures lie in a run folder of their own and in the tracker."""
    with Record(config, run_folder()) as record:
        data = build_data(config)
        record.data(data)
        generator, trained_on = trained_generator(config, data)
        refuse_trained_clips(trained_on, data)
        record.evaluation(judge(config, data, generator))
    record.print_outcome()
