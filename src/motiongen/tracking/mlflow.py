"""Runs in MLflow: a local SQLite database, or a server."""

from __future__ import annotations

import json
import logging
import os
import re
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

from filelock import FileLock

from motiongen.runs import RUN_ID_FILE, run_id_in
from motiongen.tracking.tracker import Status

if TYPE_CHECKING:
    from mlflow import MlflowClient
    from mlflow.entities import Metric

SQLITE = "sqlite:///"
LONGEST_PARAM = 250
PARENT = "mlflow.parentRunId"
"""The tag by which the user interface shows one run below another."""
LONGEST_DIGEST = 36
NOT_IN_NAMES = re.compile(r"[^\w\-. :/]")
"""What MLflow refuses in the name of a metric, such as the = of `data.draws=5` in that of a run."""
PARAMS_A_REQUEST = 100
METRICS_A_REQUEST = 1000
SECONDS_BETWEEN_REQUESTS = 5.0
"""One request costs up to 90 ms however little it holds, so metrics wait for company."""
MODEL_TRAINING = {"mlflow.experimentKind": "custom_model_development"}
"""The experiment's tag by which the user interface opens it with metrics and charts, not with traces of prompts."""

MODEL_TRAINING_VIEW = "workflowType=machine_learning"
"""The same for a page's address: a browser that was never told otherwise shows every run as one of a language model."""


class MlflowTracker:
    """Logs to the MLflow database or server at `uri`, under `experiment`.

    A run's id is kept in the run's folder; an interrupted run that is resumed there goes on under the same id.
    """

    def __init__(self, *, uri: str, experiment: str) -> None:
        self.uri = uri
        self.experiment = experiment
        self._client: MlflowClient | None = None
        self._experiment = ""
        self._run_id = ""
        self._waiting: list[Metric] = []
        self._last_request = 0.0

    def start(
        self,
        name: str,
        config: Mapping[str, Any],
        tags: Mapping[str, str],
        folder: Path | None = None,
        parent: Path | None = None,
    ) -> None:
        os.environ.setdefault("MLFLOW_DISABLE_TELEMETRY", "true")
        for noisy in ("alembic", "mlflow.store.db.utils"):
            logging.getLogger(noisy).setLevel(logging.WARNING)
        from mlflow import MlflowClient

        with self._first_contact():
            self._client = MlflowClient(self.uri)
            self._experiment = self._experiment_id(self._client)
        self._run_id = self._continued(folder)
        if not self._run_id:
            nested = {PARENT: run_id_in(parent)} if parent is not None and run_id_in(parent) else {}
            run = self._client.create_run(self._experiment, tags=dict(tags) | nested, run_name=name)
            self._run_id = run.info.run_id
            self._log_params(flattened(config))
            self._client.log_dict(self._run_id, dict(config), "config.yaml")
            if folder is not None:
                (folder / RUN_ID_FILE).write_text(self._run_id, encoding="utf-8")

    def _first_contact(self) -> AbstractContextManager[object]:
        """A lock, where the database may have to be made: processes that make one at the same time damage it."""
        if not self.uri.startswith(SQLITE):
            return nullcontext()
        database = Path(self.uri.removeprefix(SQLITE).partition("?")[0])
        database.parent.mkdir(parents=True, exist_ok=True)
        return FileLock(f"{database}.lock")

    def _experiment_id(self, client: MlflowClient) -> str:
        found = client.get_experiment_by_name(self.experiment)
        return (
            str(found.experiment_id) if found else str(client.create_experiment(self.experiment, tags=MODEL_TRAINING))
        )

    def _continued(self, folder: Path | None) -> str:
        """The id of the run begun in this folder; empty if there is none, or this database does not know it."""
        from mlflow.exceptions import MlflowException

        run_id = run_id_in(folder) if folder is not None else ""
        if not run_id:
            return ""
        try:
            self.client.update_run(run_id, status="RUNNING")
        except MlflowException:
            return ""
        return run_id

    @property
    def client(self) -> MlflowClient:
        if self._client is None:
            raise RuntimeError("start() comes first")
        return self._client

    def _log_params(self, values: Mapping[str, str]) -> None:
        from mlflow.entities import Param

        params = [Param(key, value[:LONGEST_PARAM]) for key, value in values.items()]
        for begin in range(0, len(params), PARAMS_A_REQUEST):
            self.client.log_batch(self._run_id, params=params[begin : begin + PARAMS_A_REQUEST])

    def log_metrics(self, values: Mapping[str, float], step: int | None = None) -> None:
        from mlflow.entities import Metric

        now = int(time.time() * 1000)
        taken = {NOT_IN_NAMES.sub(":", key): float(value) for key, value in values.items()}
        self._waiting += [Metric(key, value, now, step or 0) for key, value in taken.items()]
        if time.monotonic() - self._last_request > SECONDS_BETWEEN_REQUESTS:
            self._send()

    def _send(self) -> None:
        for begin in range(0, len(self._waiting), METRICS_A_REQUEST):
            self.client.log_batch(self._run_id, metrics=self._waiting[begin : begin + METRICS_A_REQUEST])
        self._waiting.clear()
        self._last_request = time.monotonic()

    def log_table(self, name: str, rows: Sequence[Mapping[str, Any]]) -> None:
        self._send()
        columns = {key: [row[key] for row in rows] for key in rows[0]} if rows else {}
        self.client.log_table(self._run_id, columns, f"{name}.json")

    def log_data(self, name: str, fingerprint: str, facts: Mapping[str, Any]) -> None:
        from mlflow.entities import Dataset, DatasetInput

        source = json.dumps({"fingerprint": fingerprint})
        dataset = Dataset(
            name, fingerprint[:LONGEST_DIGEST], "motiongen", source, profile=json.dumps(dict(facts), allow_nan=False)
        )
        self.client.log_inputs(self._run_id, datasets=[DatasetInput(dataset)])

    def log_artifact(self, path: Path, folder: str = "") -> None:
        self._send()
        if path.is_dir():
            self.client.log_artifacts(self._run_id, str(path), folder or None)
        else:
            self.client.log_artifact(self._run_id, str(path), folder or None)

    def finish(self, status: Status = "FINISHED") -> None:
        self._send()
        self.client.set_terminated(self._run_id, status)

    def how_to_open(self) -> str:
        page = f"/#/experiments/{self._experiment}/runs/{self._run_id}?{MODEL_TRAINING_VIEW}"
        if self.uri.startswith("http"):
            return f"open {self.uri.rstrip('/')}{page}"
        return f"mlflow ui --backend-store-uri {self.uri}\nthen open http://localhost:5000{page}"


def flattened(config: Mapping[str, Any]) -> dict[str, str]:
    """`{"a": {"b": 1}}` as `{"a.b": "1"}`; lists stay whole."""

    def leaves(node: Mapping[str, Any], prefix: str) -> Iterator[tuple[str, str]]:
        for key, value in node.items():
            if isinstance(value, Mapping):
                yield from leaves(value, f"{prefix}{key}.")
            else:
                yield f"{prefix}{key}", str(value)

    return dict(leaves(config, ""))
