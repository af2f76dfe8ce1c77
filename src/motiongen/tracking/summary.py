"""`summary.json`: what a run found and under which circumstances."""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from motiongen.files import replacing
from motiongen.runs import SUMMARY_FILE

LATENCY = "milliseconds_per_frame"
"""What a frame of a single motion costs a generator."""
VERSIONS_OF = ("motiongen", "torch", "pytorch-lightning", "numpy", "hydra-core", "mlflow")


def circumstances(seconds: float) -> dict[str, Any]:
    """Where, with what and at what cost a run ran.

    Args:
        seconds: wall time of the run.
    """
    return {
        "wall_time_seconds": round(seconds, 1),
        "peak_memory_mib": peak_memory_mib(),
        "git_revision": git_revision(),
        "versions": versions(),
        "platform": platform.platform(),
        "processors": os.cpu_count(),
    }


def write_summary(folder: Path, values: Mapping[str, Any]) -> Path:
    """Writes `summary.json` into a run's folder, whole or not at all.

    Args:
        folder: the run's folder.
        values: plain values; None for what could not be measured.

    Raises:
        ValueError: a number is not finite, which JSON cannot hold.
    """
    path = folder / SUMMARY_FILE
    with replacing(path) as partial:
        partial.write_text(json.dumps(values, indent=2, allow_nan=False) + "\n", encoding="utf-8")
    return path


def peak_memory_mib() -> float | None:
    """The most memory that this process has held so far, MiB; None where the platform does not tell."""
    try:
        for line in Path("/proc/self/status").read_text(encoding="ascii").splitlines():
            if line.startswith("VmHWM:"):
                return round(int(line.split()[1]) / 1024, 1)
    except OSError:
        pass
    try:
        import resource
    except ImportError:
        return None
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return round(peak / 1024**2 if sys.platform == "darwin" else peak / 1024, 1)


def git_revision() -> str | None:
    """The commit of the checkout that motiongen runs from, with `+dirty` if files differ; None outside a checkout."""
    folder = Path(__file__).resolve().parent

    def git(*arguments: str) -> str:
        done = subprocess.run(["git", "-C", str(folder), *arguments], capture_output=True, text=True, check=True)
        return done.stdout.strip()

    try:
        if not git("ls-files", "--", Path(__file__).name):  # installed below somebody else's checkout
            return None
        changed = git("status", "--porcelain", "--untracked-files=no")
        return git("rev-parse", "HEAD") + ("+dirty" if changed else "")
    except (OSError, subprocess.CalledProcessError):
        return None


def versions() -> dict[str, str]:
    """Versions of what decides about a result."""
    found = {"python": platform.python_version()}
    for package in VERSIONS_OF:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            continue
    return found
