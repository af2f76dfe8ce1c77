"""What a task leaves behind: the resolved configuration, summary.json, the tracker's run and the closing lines."""

from __future__ import annotations

import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType, TracebackType
from typing import Any, Self

from hydra.core.hydra_config import HydraConfig
from hydra.types import RunMode
from hydra.utils import instantiate
from omegaconf import DictConfig, OmegaConf

from motiongen.data.datamodule import MotionData
from motiongen.evaluation.curves import draw_curves
from motiongen.evaluation.latents import LATENTS_FILE, LatentSpace, draw_latents
from motiongen.evaluation.long_results import (
    PREFIXES,
    LongResult,
    curve_rows,
    long_rows,
    long_scalars,
    long_training_rows,
    to_json,
)
from motiongen.evaluation.results import REAL, Evaluation
from motiongen.evaluation.table import (
    action_rows,
    disagreements,
    further_rows,
    interval_rows,
    length_rows,
    markdown,
    metric_rows,
    report,
    training_rows,
)
from motiongen.recognition.recognizer import TrainedRecognizer
from motiongen.resolvers import changes_in, current_run_name
from motiongen.studies.naming import CHANGES, changes_text, chosen_row
from motiongen.tracking.summary import LATENCY, circumstances, write_summary
from motiongen.tracking.tags import choice_tags
from motiongen.tracking.tracker import Tracker

CONFIG_FILE = "config.yaml"


class Record:
    """Opens the tracker's run on entry; on exit writes summary.json and closes the run with what became of it.

    Args:
        config: the configuration of the task.
        folder: the run folder.
    """

    def __init__(self, config: DictConfig, folder: Path) -> None:
        self._config = config
        self._folder = folder
        self._summary: dict[str, Any] = {}
        self._closing: list[str] = []
        self.tracker: Tracker = instantiate(config.tracker)

    def __enter__(self) -> Self:
        self._started = time.monotonic()
        resolved: Any = OmegaConf.to_container(self._config, resolve=True)
        OmegaConf.save(resolved, self._folder / CONFIG_FILE)
        hydra = HydraConfig.get()
        tags = choice_tags(self._config, hydra.runtime.choices) | {"seed": str(self._config.seed)}
        if row := chosen_row(hydra.runtime.choices):
            tags |= {"study": row.study, "row": row.name, CHANGES: changes_text(changes_in(hydra.overrides.task))}
        name = current_run_name(self._config)
        parent = Path(hydra.sweep.dir) if hydra.mode is RunMode.MULTIRUN else None
        self.tracker.start(name, resolved, tags, self._folder, parent)
        self._summary = {"name": name, "seed": self._config.seed, "command": sys.argv[1:]}
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is not None:
            self.tracker.finish("KILLED" if kind is KeyboardInterrupt else "FAILED")
            return
        self._summary |= circumstances(time.monotonic() - self._started)
        path = write_summary(self._folder, self._summary)
        self.tracker.log_artifact(path)
        self.tracker.finish()

    def data(self, data: MotionData) -> None:
        """Which data, and how it was split."""
        self._summary["data"] = {
            "name": data.name,
            "fingerprint": data.fingerprint,
            "train_clips": len(data.split.train),
            "test_clips": len(data.split.test),
            "tags": list(data.tags),
            "left_out": data.split.left_out,
        }
        self.tracker.log_data(data.name, data.fingerprint, self._summary["data"])

    def preparation(self, lines: Sequence[str], pictures: Sequence[Path]) -> None:
        """What preparing the data came to, in Markdown, and pictures of it."""
        path = self._folder / "data.md"
        path.write_text("\n".join(lines) + "\n", encoding="utf-8", errors="backslashreplace")
        for file in (path, *pictures):
            self.tracker.log_artifact(file)
        self._closing.append("\n".join([*lines, *(f"Picture: {picture}" for picture in pictures)]))

    def evaluation(
        self, evaluations: Sequence[Evaluation], groups: Mapping[str, Sequence[str]] = MappingProxyType({})
    ) -> None:
        """The metrics, everywhere: under the first recognizer, and under a second one where there is one.

        Args:
            evaluations: one a recognizer.
            groups: systems that are trainings of one composition, by its name.
        """
        parts = []
        for evaluation, prefix in zip(evaluations, ("", "second_"), strict=False):
            systems = [name for name in evaluation.systems if name not in (REAL, "untrained")]
            self._summary[f"{prefix}evaluation"] = evaluation.to_json()
            scalars = evaluation.scalars()
            self.tracker.log_metrics({f"{prefix}{name}": value for name, value in scalars.items()})
            self.tracker.log_table(f"{prefix}metrics", metric_rows(evaluation))
            self.tracker.log_table(f"{prefix}further_metrics", further_rows(evaluation))
            self.tracker.log_table(f"{prefix}intervals", interval_rows(evaluation))
            for frames, values in evaluation.length_scalars().items():
                self.tracker.log_metrics({f"{prefix}{name}": value for name, value in values.items()}, step=frames)
            if evaluation.protocol.lengths:
                self.tracker.log_table(f"{prefix}lengths", length_rows(evaluation))
            parts.append(report(evaluation))
            if groups:
                rows = training_rows(evaluation, groups)
                self.tracker.log_table(f"{prefix}trainings", rows)
                parts += ["Over trainings, mean ± 1.96 std / sqrt(n):", markdown(rows)]
            for name in systems:
                rows = action_rows(evaluation, name)
                self.tracker.log_table(f"{prefix}actions_{name}" if len(systems) > 1 else f"{prefix}actions", rows)
                parts += [f"Actions of {name}:", markdown(rows)]
        if len(evaluations) > 1:
            differing = disagreements(*evaluations)
            parts += ["The two recognizers order all systems alike." if not differing else "They disagree about:"]
            parts += [f"- {text}" for text in differing]
        path = self._folder / "metrics.md"
        path.write_text("\n\n".join(parts) + "\n", encoding="utf-8")
        self.tracker.log_artifact(path)
        self._closing += parts

    def long_motion(
        self,
        kind: str,
        results: Sequence[Mapping[str, LongResult]],
        groups: Mapping[str, Sequence[str]],
        protocol: Mapping[str, Any],
        recognizers: Sequence[TrainedRecognizer],
    ) -> None:
        """Figures of long motions on one kind of sequences: under the first recognizer, and under a second one.

        Args:
            kind: of the sequences.
            results: one a recognizer: system to its figures.
            groups: systems that are trainings of one composition, by its name.
            protocol: of the sequences.
            recognizers: that judged, in the order of the results.
        """
        parts = []
        self._summary["recognizers"] = [
            {
                "name": type(one.recognizer).__name__,
                "fingerprint": one.fingerprint,
                "test_accuracy": one.test_accuracy,
            }
            for one in recognizers
        ]
        self._summary["sequences"] = dict(protocol)
        for own, prefix in zip(results, PREFIXES, strict=False):
            name = f"{prefix}{kind}"
            self._summary[f"{name}_long_motion"] = {system: to_json(result) for system, result in own.items()}
            parts += [f"Sequences: {name.replace('_', ' recognizer, ')}", markdown(long_rows(own))]
            self.tracker.log_metrics({f"{name}/{key}": value for key, value in long_scalars(own).items()})
            self.tracker.log_table(f"{name}_long_motion", long_rows(own))
            self.tracker.log_table(f"{name}_curves", curve_rows(own))
            present = {group: [one for one in names if one in own] for group, names in groups.items()}
            if rows := long_training_rows(own, {group: names for group, names in present.items() if names}):
                self.tracker.log_table(f"{name}_trainings", rows)
                parts += ["Over trainings, mean ± 1.96 std / sqrt(n):", markdown(rows)]
            path = self._folder / f"{name}_curves.png"
            draw_curves(path, own)
            self.tracker.log_artifact(path)
        path = self._folder / f"{kind}_long_motion.md"
        path.write_text("\n\n".join(parts) + "\n", encoding="utf-8")
        self.tracker.log_artifact(path)
        self._closing += parts

    def latents(self, space: LatentSpace) -> None:
        """The codes of the test clips, as a picture, and how much of the action can be read from them."""
        figures = space.figures()
        self._summary["latents"] = figures
        self.tracker.log_metrics({f"generated/{name}": value for name, value in figures.items()})
        path = self._folder / LATENTS_FILE
        draw_latents(path, space)
        self.tracker.log_artifact(path)
        self._closing.append(
            f"Actions read from the codes of test clips: {space.before:.3f} before conditioning, {space.after:.3f} "
            f"after, {space.commonest:.3f} by naming the commonest ({path.name})"
        )

    def latency(self, milliseconds: float) -> None:
        """What a frame of a single motion costs."""
        self._summary[LATENCY] = milliseconds
        self.tracker.log_metrics({f"generated/{LATENCY}": milliseconds})

    def previews(self, page: Path, *pictures: Path) -> None:
        """Files to watch, in the tracker, too."""
        for path in (page, *pictures):
            self.tracker.log_artifact(path, "previews")
        self._closing.append(f"Watch the motion: {page}")

    def exports(self, paths: Sequence[Path]) -> None:
        """Files for other tools, in the tracker, too."""
        for path in paths:
            self.tracker.log_artifact(path, "exports")
            self._closing.append(f"For other tools: {path}")

    def recognizer(self, recognizer: TrainedRecognizer) -> None:
        """Which recognizer, and how good it is."""
        self._summary["recognizer"] = {
            "fingerprint": recognizer.fingerprint,
            "test_accuracy": recognizer.test_accuracy,
            "was_trained": recognizer.was_trained,
        }
        self.tracker.log_metrics({"recognizer/test_accuracy": recognizer.test_accuracy})
        origin = "trained now" if recognizer.was_trained else "from the cache"
        accuracy = f"accuracy {recognizer.test_accuracy:.3f} on real test clips"
        self._closing.append(f"Recognizer {recognizer.fingerprint[:12]} ({origin}): {accuracy}")

    def print_outcome(self) -> None:
        """The closing lines: tables, where the motion lies, how to open the tracker."""
        lines = ["\n\n".join(self._closing), "", f"Run folder: {self._folder}"]
        if command := self.tracker.how_to_open():
            lines.append(f"Browse the runs: {command}")
        print("\n".join(lines))
