"""`task=known_cases`: what every figure says of motions whose faults are known, and how FID depends on N."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from hydra.utils import instantiate
from omegaconf import DictConfig

from motiongen.evaluation.evaluator import evaluate, features_of
from motiongen.evaluation.known_cases import known_cases, real_against_real
from motiongen.evaluation.protocol import Protocol
from motiongen.evaluation.table import footnote, markdown, reaction_rows
from motiongen.recognition.cache import obtain_recognizer
from motiongen.tasks.assembly import build_data

SIZES = (100, 300, 1000)
DRAWS = 10


def run(config: DictConfig) -> None:
    """Print the two tables."""
    data = build_data(config)
    recognizer = obtain_recognizer(config.recognizer, data, Path(config.cache))
    # The cases are test clips, which have the length that they have.
    protocol: Protocol = replace(instantiate(config.evaluation), lengths=())
    batches = list(data.test_batches(protocol.batch_size))
    (evaluation,) = evaluate(known_cases(batches), data, [recognizer], protocol)
    print(markdown(reaction_rows(evaluation)))
    print(f"\n{footnote(evaluation)} Arrows: differs from the real clips' value by more than a tenth.\n")
    clips = [*data.train_windows(protocol.batch_size), *batches]
    features = features_of(recognizer.recognizer, clips)
    print(markdown(real_against_real(features, SIZES, DRAWS, protocol.first_seed)))
    print(f"\nReal clips, training and test, against others of them: mean of {DRAWS} draws ± 1.96 standard errors.")
