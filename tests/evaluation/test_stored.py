from __future__ import annotations

import copy
import json
from pathlib import Path

import pytest

from motiongen.configuration import check
from motiongen.errors import InputError
from motiongen.evaluation.stored import alike, read_result, result_rows
from motiongen.evaluation.table import HEADINGS
from motiongen.tasks.report import run

METRICS = {metric: {"mean": 0.5, "interval": None if metric == "fid" else 0.25} for metric in HEADINGS}
EVALUATION = {
    "protocol": {"seeds": 5, "first_seed": 0},
    "data_fingerprint": "a" * 64,
    "recognizer": {"name": "TransformerRecognizer", "fingerprint": "b" * 64},
    "count": 100,
    "systems": {name: {"metrics": METRICS, "count": 100} for name in ("real", "generated", "untrained")},
}


def stored(folder: Path, name: str, **changes: object) -> Path:
    folder.mkdir()
    evaluation = copy.deepcopy(EVALUATION) | changes
    (folder / "summary.json").write_text(json.dumps({"name": name, "evaluation": evaluation}))
    return folder


def test_results_that_were_measured_alike_are_one_table(tmp_path: Path) -> None:
    results = [read_result(stored(tmp_path / name, name)) for name in ("one", "two")]
    (group,) = alike(results)
    rows = result_rows(group)
    assert [row["run"] for row in rows] == ["real", "one", "two"]
    assert rows[1]["accuracy"] == "0.500 ± 0.250"
    assert rows[1]["FID"] == "0.500"
    assert rows[1]["N"] == "100"


def test_what_keeps_results_from_being_compared_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folders = [
        stored(tmp_path / "one", "one"),
        stored(tmp_path / "two", "two", protocol={"seeds": 20, "first_seed": 0}, data_fingerprint="c" * 64),
        stored(tmp_path / "three", "three"),
        stored(tmp_path / "four", "four", recognizer={"name": "STGCN", "fingerprint": "d" * 64}),
    ]
    run(check(["task=report", f"results=[{','.join(map(str, folders))}]"]))
    shown = capsys.readouterr().out
    first, second, third = shown.split("These do not compare with those of one:")
    assert "| one " in first
    assert "| three " in first
    assert "- protocol.seeds: 5 and 20\n- data_fingerprint: aaaaaaaaaaaa and cccccccccccc\n" in second
    assert "- recognizer.name: TransformerRecognizer and STGCN\n" in third


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (None, "no such file; has the run finished?"),
        ("{", "not a summary of a run"),
        ("[]", "not a summary of a run"),
        ('{"name": "x"}', "field 'evaluation' is missing"),
        (
            json.dumps({"name": "x", "evaluation": {**EVALUATION, "systems": {"real": {"metrics": {}, "count": 9}}}}),
            "'accuracy'",
        ),
    ],
)
def test_what_is_no_result_is_told(tmp_path: Path, content: str | None, told: str) -> None:
    if content is not None:
        (tmp_path / "summary.json").write_text(content)
    with pytest.raises(InputError, match=told) as caught:
        read_result(tmp_path)
    assert str(tmp_path / "summary.json") in str(caught.value)
