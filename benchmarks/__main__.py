"""Our code beside plain reference code, in one run: `python -m benchmarks [row ...] [--quick]`.

Prints every row when it is measured. `--page` writes the page of all results, `--tracker mlflow` keeps them in MLflow.
OMP_NUM_THREADS decides the threads.
"""

from __future__ import annotations

import argparse
import importlib
import os
import time
from pathlib import Path
from tempfile import TemporaryDirectory

from hydra.utils import instantiate

from benchmarks import report
from benchmarks.measuring import Effort, machine
from benchmarks.rows import ROWS
from motiongen.configuration import compose
from motiongen.evaluation.table import markdown
from motiongen.tracking.tracker import Tracker


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("rows", nargs="*", metavar="row", help=f"all of them by default: {', '.join(ROWS)}")
    parser.add_argument("--quick", action="store_true", help="tiny sizes: shows that everything runs")
    parser.add_argument("--page", type=Path, help="the Markdown file to write")
    parser.add_argument("--tracker", default="none", choices=("none", "mlflow"))
    options = parser.parse_args()
    if unknown := sorted(set(options.rows) - set(ROWS)):
        parser.error(f"there is no row {', '.join(unknown)}; there are {', '.join(ROWS)}")
    effort = Effort(quick=options.quick)
    tracker: Tracker = instantiate(compose([f"tracker={options.tracker}"]).tracker)
    about = machine(effort)
    print(markdown([{"machine": name, "": value} for name, value in about.items()]), end="\n\n", flush=True)
    tracker.start("benchmarks", {"machine": about, "rows": options.rows or list(ROWS)}, {"task": "benchmarks"})
    sections = []
    try:
        with TemporaryDirectory() as compiled:
            # How long compiling takes is a result, so that nothing may be there from an earlier run.
            os.environ["TORCHINDUCTOR_CACHE_DIR"] = compiled
            for name in options.rows or ROWS:
                sections.append(_measured(name, effort, tracker))
                if options.page:  # after every row: one that fails takes no other with it
                    options.page.write_text(report.page(about, sections), encoding="utf-8")
        if options.page:
            tracker.log_artifact(options.page)
    except BaseException:
        tracker.finish("FAILED")
        raise
    tracker.finish()
    if opening := tracker.how_to_open():
        print(opening)


def _measured(name: str, effort: Effort, tracker: Tracker) -> str:
    row = importlib.import_module(f"benchmarks.rows.{name}")
    start = time.perf_counter()
    results = row.measure(effort)
    section = report.section(row, results)
    print(f"{section}\n\n{name} took {time.perf_counter() - start:.0f} s\n", flush=True)
    found = [(one.name, metric, value) for one in results for metric, value in one.metrics().items()]
    tracker.log_metrics({f"{name}/{result}/{metric}": value for result, metric, value in found})
    tracker.log_table(name, [{"result": result, "metric": metric, "value": value} for result, metric, value in found])
    return section


if __name__ == "__main__":
    main()
