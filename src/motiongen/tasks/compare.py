"""`task=compare runs=[...]`: the generators of several runs in one table, on the same clips."""

from __future__ import annotations

from omegaconf import DictConfig

from motiongen.tasks.assembly import build_data, run_folder
from motiongen.tasks.judging import judge_systems, system
from motiongen.tasks.record import Record
from motiongen.tasks.trained import grouped, trained_runs


def run(config: DictConfig) -> None:
    """Judge the runs on the data of this command; differences are taken from the first run."""
    with Record(config, run_folder()) as record:
        data = build_data(config)
        record.data(data)
        runs = trained_runs(config.runs, data, trust=config.trust)
        systems = {one.name: system(one.config, one.generator) for one in runs}
        record.evaluation(judge_systems(config, data, systems), grouped(runs))
    record.print_outcome()
