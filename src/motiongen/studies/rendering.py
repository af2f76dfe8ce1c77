"""A study's table as Markdown, CSV, LaTeX and HTML."""

from __future__ import annotations

import base64
import csv
import html
import io
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

from motiongen.evaluation.table import markdown
from motiongen.studies.table import Cell, StudyTable, columns_published, interval_text

LEGEND = (
    "Means over trainings [95% interval by Student's t]. Bold: the best mean; =: not told from it by Welch's t-test at "
    "5%. Diversity, multimodality, speed and gaps at seams are best where they are nearest to the real clips'."
)
CODES_LEGEND = (
    "Codes of the test clips: the share whose action is that of the nearest centroid of training clips' codes, before "
    "and after conditioning, and the share of the commonest action."
)
Rows = Sequence[Mapping[str, str]]
"""Lines of a further table, all with the same columns"""
Style = Callable[[str, Cell], str]
"""How a figure is marked as the best or as a tie."""


def as_markdown(table: StudyTable, codes: Rows = ()) -> str:
    """The table with all that has to be known to read it; `codes`: what the codes tell of the action."""
    parts = [f"# {table.study}: {table.title}", _markdown_grid(table), *_remarks(table)]
    if table.second:
        parts += [_second_heading(table.second), _markdown_grid(table.second), *_second_remarks(table)]
    if codes:
        parts += [CODES_LEGEND, markdown([dict(row) for row in codes])]
    return "\n\n".join(parts) + "\n"


def _markdown_grid(table: StudyTable) -> str:
    columns, *lines = _grid(table, lambda text, cell: {"best": f"**{text}**", "tie": f"{text} ="}.get(cell.mark, text))
    return markdown([dict(zip(columns, line, strict=True)) for line in lines])


def as_csv(table: StudyTable) -> str:
    """One line a row and metric: row, trainings, metric, mean, low, high, published, mark, recognizer."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["row", "trainings", "metric", "mean", "low", "high", "published", "mark", "recognizer"])
    for own in filter(None, (table, table.second)):
        for row, cells in own.rows.items():
            for metric, cell in cells.items():
                published = "" if cell.published is None else cell.published
                figures = [cell.ours.value, cell.ours.low, cell.ours.high, published, cell.mark]
                writer.writerow([row, own.trainings[row], metric, *figures, own.recognizer])
    return text.getvalue()


def as_latex(table: StudyTable) -> str:
    """A `tabular` for the package booktabs, and another one for what a second recognizer says."""
    remarks = [LEGEND, table.protocol]
    if table.second:
        remarks += [table.second.protocol, table.disagreement]
    tables = [_tabular(own) for own in (table, table.second) if own]
    return "\n\n".join(tables) + "\n" + "".join(f"% {remark}\n" for remark in remarks)


def _tabular(table: StudyTable) -> str:

    def style(text: str, cell: Cell) -> str:
        return {"best": rf"\textbf{{{text}}}", "tie": rf"\underline{{{text}}}"}.get(cell.mark, text)

    columns, *lines = _grid(table, style)
    body = [" & ".join(_escaped(text) for text in line) + r" \\" for line in (columns, *lines)]
    parts = [rf"\begin{{tabular}}{{l{'r' * (len(columns) - 1)}}}", r"\toprule", body[0], r"\midrule", *body[1:]]
    return "\n".join([*parts, r"\bottomrule", r"\end{tabular}"])


def as_html(table: StudyTable, pictures: Sequence[Path], codes: Rows = ()) -> str:
    """One page with the tables and the pictures in it."""
    remarks = _paragraphs(_remarks(table))
    if table.second:
        remarks += f"\n<p>{html.escape(_second_heading(table.second))}</p>\n{_html_grid(table.second)}\n"
        remarks += _paragraphs(_second_remarks(table))
    if codes:
        remarks += f"\n<p>{html.escape(CODES_LEGEND)}</p>\n{_plain_table(codes)}"
    images = "\n".join(f'<img src="data:image/png;base64,{_base64(path)}" alt="{path.stem}">' for path in pictures)
    return PAGE.format(
        title=html.escape(f"{table.study}: {table.title}"), table=_html_grid(table), remarks=remarks, images=images
    )


def _html_grid(table: StudyTable) -> str:
    def style(text: str, cell: Cell) -> str:
        return {"best": f"<b>{text}</b>", "tie": f"{text} ="}.get(cell.mark, text)

    columns, *lines = _grid(table, style)
    head = "".join(f"<th>{html.escape(column)}</th>" for column in columns)
    body = "\n".join(f"<tr>{''.join(f'<td>{text}</td>' for text in line)}</tr>" for line in lines)
    return f"<table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{body}\n</tbody>\n</table>"


def _paragraphs(texts: Iterable[str]) -> str:
    return "\n".join(f"<p>{html.escape(text)}</p>" for text in texts)


def _plain_table(rows: Rows) -> str:
    lines = [[*rows[0]], *([*row.values()] for row in rows)]
    body = "\n".join(f"<tr>{''.join(f'<td>{html.escape(text)}</td>' for text in line)}</tr>" for line in lines)
    return f"<table>\n{body}\n</table>"


def _grid(table: StudyTable, style: Style) -> list[list[str]]:
    """Columns' headings, the line of the real clips, one line a row."""
    published = columns_published(table)
    columns, real = ["row", "trainings"], ["real", ""]
    for metric in table.metrics:
        value = table.real[metric]
        columns.append(table.heading(metric))
        real.append("-" if value is None else table.number(metric, value))
        if metric in published:
            columns.append(f"{table.heading(metric)}, paper")
            real.append("")
    lines = [columns, real]
    for row, cells in table.rows.items():
        line = [row.replace("_", " "), str(table.trainings[row])]
        for metric, cell in cells.items():
            line.append(style(interval_text(metric, cell.ours), cell))
            if metric in published:
                line.append("" if cell.published is None else f"{cell.published:g}")
        lines.append(line)
    return lines


def _remarks(table: StudyTable) -> Iterable[str]:
    yield LEGEND
    yield table.protocol
    if table.verdict():
        yield table.verdict()
    if table.unfinished:
        yield f"Without a result: {'; '.join(table.unfinished)}."


def _second_heading(second: StudyTable) -> str:
    return f"The same motions before {second.recognizer}:"


def _second_remarks(table: StudyTable) -> Iterable[str]:
    if table.second:
        yield table.second.protocol
        if table.second.verdict():
            yield table.second.verdict()
        yield table.disagreement


def _escaped(text: str) -> str:
    return text.replace("%", r"\%").replace("_", r"\_").replace("³", "$^3$").replace("±", r"$\pm$")


def _base64(path: Path) -> str:
    return base64.b64encode(path.read_bytes()).decode("ascii")


PAGE = """<!doctype html>
<html lang="en">
<meta charset="utf-8">
<title>{title}</title>
<style>
body {{ font: 15px/1.5 system-ui, sans-serif; margin: 2rem; color: #222; }}
table {{ border-collapse: collapse; }}
th, td {{ padding: 0.3rem 0.7rem; border-bottom: 1px solid #ddd; text-align: right; }}
td {{ white-space: nowrap; }}
th:first-child, td:first-child {{ text-align: left; }}
img {{ max-width: 100%; }}
p {{ max-width: 60rem; }}
</style>
<h1>{title}</h1>
{table}
{remarks}
{images}
</html>
"""
