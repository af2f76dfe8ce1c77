"""The verbs that a user types: what each needs, and where it is. Nothing heavy is imported before one of them runs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from omegaconf import DictConfig


@dataclass(frozen=True)
class Task:
    """One verb."""

    run: Callable[[DictConfig], None]
    reads: tuple[str, ...] = ()
    """Top-level sections and keys of the configuration that must be complete and right."""
    needs: tuple[str, ...] = ()
    """Top-level keys that may not be null; of several with `|` between them, one."""
    needs_experiment: bool = False
    answers: bool = False
    """Whether it only prints: it runs at once, before Hydra makes a folder."""


def _train(config: DictConfig) -> None:
    from motiongen.tasks.train import run

    run(config)


def _evaluate(config: DictConfig) -> None:
    from motiongen.tasks.evaluate import run

    run(config)


def _compare(config: DictConfig) -> None:
    from motiongen.tasks.compare import run

    run(config)


def _known_cases(config: DictConfig) -> None:
    from motiongen.tasks.known_cases import run

    run(config)


def _synthesize(config: DictConfig) -> None:
    from motiongen.tasks.synthesize import run

    run(config)


def _long_motion(config: DictConfig) -> None:
    from motiongen.tasks.long_motion import run

    run(config)


def _prepare(config: DictConfig) -> None:
    from motiongen.tasks.receipts import Receipt

    receipt = Receipt.of(config)
    if report := receipt.report():
        print("\n".join(report))
        return
    from motiongen.tasks.prepare import run

    run(config, receipt)


def _train_recognizer(config: DictConfig) -> None:
    from motiongen.tasks.train_recognizer import run

    run(config)


def _report(config: DictConfig) -> None:
    from motiongen.tasks.report import run

    run(config)


def _list(config: DictConfig) -> None:
    from motiongen.tasks.list import run

    run(config)


def _compositions(config: DictConfig) -> None:
    from motiongen.tasks.compositions import run

    run(config)


JUDGING = ("recognizer", "second_recognizer", "evaluation")
MEASURING = ("scale", "data", "body", *JUDGING, "generator", "tracker")
TASKS: dict[str, Task] = {
    "train": Task(_train, (*MEASURING, "objective", "optimizer", "trainer", "init"), needs_experiment=True),
    "evaluate": Task(_evaluate, MEASURING, needs=("run|motions",)),
    "compare": Task(_compare, ("scale", "data", *JUDGING, "tracker"), needs=("runs",)),
    "known_cases": Task(_known_cases, ("scale", "data", "recognizer", "evaluation")),
    "synthesize": Task(
        _synthesize,
        ("scale", "data", "body", "recognizer", "correction", "generator", "tracker", "formats", "timeline"),
        needs=("run", "timeline"),
    ),
    "long_motion": Task(
        _long_motion, ("scale", "data", *JUDGING, "sequences", "corrections", "tracker"), needs=("runs",)
    ),
    "prepare": Task(_prepare, ("scale", "data", "body", "tracker")),
    "train_recognizer": Task(_train_recognizer, ("scale", "data", "recognizer", "tracker")),
    "report": Task(_report, needs=("results|study",), answers=True),
    "list": Task(_list, answers=True),
    "compositions": Task(_compositions, answers=True),
}
