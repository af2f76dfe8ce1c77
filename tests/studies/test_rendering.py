from __future__ import annotations

import copy
import csv
import io
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from matplotlib.image import imread
from omegaconf import OmegaConf

from motiongen.evaluation.stored import StoredResult
from motiongen.evaluation.table import FURTHER, HEADINGS
from motiongen.studies.latents import code_rows, read_picture
from motiongen.studies.naming import StudyError
from motiongen.studies.plots import draw_rows, lay_side_by_side
from motiongen.studies.rendering import as_csv, as_html, as_latex, as_markdown
from motiongen.studies.results import StudyResults
from motiongen.studies.statistics import over_trainings
from motiongen.studies.table import study_table

FIDS = {"full": (0.5, 0.6), "without_part": (2.0, 2.2), "ours_alone": (0.52, 0.61)}
SETTINGS = OmegaConf.create(
    {
        "name": "parts",
        "metrics": ["fid", "accuracy"],
        "published": {"source": "Paper, Table 2", "rows": {"full": {"fid": 1.1}, "without_part": {"fid": 3.3}}},
    }
)


def result(fid: float) -> StoredResult:
    metrics = {metric: {"mean": 0.9} for metric in HEADINGS | FURTHER}
    generated = {**metrics, "fid": {"mean": fid}}
    systems = {"generated": {"metrics": generated, "count": 50}, "real": {"metrics": metrics, "count": 50}}
    evaluation = {
        "systems": systems,
        "protocol": {"seeds": 2},
        "count": 50,
        "seeds": [0, 1],
        "data_fingerprint": "d" * 64,
        "recognizer": {"name": "Judge", "fingerprint": "f" * 64, "test_accuracy": 0.9},
    }
    return StoredResult("run", evaluation)


RESULTS = StudyResults(
    "parts", "id", {row: tuple(map(result, fids)) for row, fids in FIDS.items()}, ("broken-s0: failed",)
)
TABLE = study_table(RESULTS, SETTINGS, "what <parts> are worth")


def test_markdown_shows_rows_in_the_papers_order_with_what_it_published() -> None:
    lines = as_markdown(TABLE).splitlines()
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if line.startswith("| ")]
    assert rows[0] == ["row", "trainings", "FID", "FID, paper", "accuracy"]
    assert [row[0] for row in rows[2:]] == ["real", "full", "without part", "ours alone"]
    assert rows[3][2].startswith("**0.550 [")
    assert rows[3][3] == "1.1"
    assert rows[5][2].endswith("=")
    assert not rows[4][2].endswith("=")
    text = "\n".join(lines)
    assert "Kendall's tau between this order of the rows and that of Paper, Table 2: FID +1.00 [+1.00, +1.00]." in text
    assert "Without a result: broken-s0: failed." in text


def test_csv_has_every_number_and_reads_back() -> None:
    rows = list(csv.DictReader(io.StringIO(as_csv(TABLE))))
    assert len(rows) == len(FIDS) * 2
    first = rows[0]
    assert (first["row"], first["metric"], first["trainings"], first["mark"]) == ("full", "fid", "2", "best")
    assert float(first["mean"]) == pytest.approx(0.55)
    assert float(first["published"]) == 1.1


def test_latex_marks_the_best_and_escapes() -> None:
    text = as_latex(TABLE)
    assert r"\textbf{0.550" in text
    assert r"\underline{0.565" in text
    body = text.split(r"\midrule")[1].split(r"\bottomrule")[0]
    assert all(line.count("&") == 4 for line in body.strip().splitlines())


def test_the_page_holds_its_picture_and_runs_nothing(tmp_path: Path) -> None:
    draw_rows(tmp_path / "report.png", TABLE)
    page = as_html(TABLE, [tmp_path / "report.png"])
    assert "what &lt;parts&gt; are worth" in page
    assert 'src="data:image/png;base64,iVBOR' in page
    assert "<script" not in page
    assert "http" not in page


def judged_twice(seconds: dict[str, tuple[float, float]]) -> StudyResults:
    """The trainings of RESULTS, of which a second recognizer says these FIDs and another accuracy."""

    def second(fid: float) -> dict[str, Any]:
        evaluation = copy.deepcopy(dict(result(fid).evaluation))
        evaluation["recognizer"]["name"] = "Other"
        evaluation["systems"]["generated"]["metrics"]["accuracy"] = {"mean": 1 - fid / 100}
        return evaluation

    rows = {
        row: tuple(replace(one, second_evaluation=second(fid)) for one, fid in zip(own, seconds[row], strict=True))
        for row, own in RESULTS.rows.items()
    }
    return replace(RESULTS, rows=rows)


def test_a_second_recognizer_has_a_table_of_what_it_was_asked(tmp_path: Path) -> None:
    twice = judged_twice({"full": (0.9, 1.1), "without_part": (2.0, 2.2), "ours_alone": (0.5, 0.6)})
    table = study_table(twice, OmegaConf.merge(SETTINGS, {"metrics": ["fid", "accuracy", "joint_speed"]}), "")
    text = as_markdown(table)
    after = text.split("The same motions before Other:")[1]
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in after.splitlines() if line[:2] == "| "]
    assert rows[0] == ["row", "trainings", "FID", "FID, paper", "accuracy"]
    assert rows[3][2].startswith("1.000 [")
    assert rows[5][2].startswith("**0.550 [")
    assert "different orders by FID (Judge has full before ours alone)." in after
    assert "in the same order by accuracy, and in different orders" in after
    assert "FID +1.00 [+1.00, +1.00]" in after
    lines = list(csv.DictReader(io.StringIO(as_csv(table))))
    assert [line["recognizer"] for line in lines] == ["Judge"] * 9 + ["Other"] * 6
    assert as_latex(table).count(r"\begin{tabular}") == 2
    draw_rows(tmp_path / "report.png", table)
    assert as_html(table, [tmp_path / "report.png"]).count("<thead>") == 2


def test_recognizers_that_agree_are_said_to() -> None:
    table = study_table(judged_twice({row: (own[0] + 1, own[1] + 1) for row, own in FIDS.items()}), SETTINGS, "")
    assert "Judge and Other put the rows in the same order by FID" in as_markdown(table)


def test_a_second_recognizer_that_not_all_rows_had_is_left_out() -> None:
    twice = judged_twice(FIDS)
    some = {**twice.rows, "full": RESULTS.rows["full"]}
    assert study_table(replace(twice, rows=some), SETTINGS, "").second is None
    assert TABLE.second is None


def test_a_metric_that_does_not_exist_is_named() -> None:
    with pytest.raises(StudyError, match="no metric 'fidd'; did you mean 'fid'"):
        study_table(RESULTS, OmegaConf.merge(SETTINGS, {"metrics": ["fidd"]}), "")


def test_codes_get_a_table_and_their_pictures_side_by_side(tmp_path: Path) -> None:
    def training(before: float) -> StoredResult:
        return replace(
            result(1.0), latents={"tag_from_latent": before, "tag_from_modulated": 0.9, "tag_by_commonest": 0.1}
        )

    rows = {"with_codes": (training(0.2), training(0.3)), "without": (result(1.0),)}
    codes = code_rows(StudyResults("parts", "id", rows, ()))
    half = over_trainings([0.2, 0.3])
    assert codes == [
        {
            "row": "with codes",
            "before": f"0.250 [{half.low:.3f}, {half.high:.3f}]",
            "after": "0.900 [0.900, 0.900]",
            "commonest": "0.100 [0.100, 0.100]",
        }
    ]
    assert "| with codes | 0.250 [" in as_markdown(TABLE, codes)
    draw_rows(tmp_path / "one.png", TABLE)
    content = read_picture(tmp_path / "one.png")
    lay_side_by_side(tmp_path / "all.png", {"first": content, "second_row": content})
    height, width, _ = imread(tmp_path / "all.png").shape
    assert height > width / 2
    assert "<td>with codes</td>" in as_html(TABLE, [tmp_path / "all.png"], codes)
