"""What a newcomer and CI run: `nox -s marionette` shows a trained generator, `nox -s tests` passes the tests.

Where no NVIDIA GPU is, torch should come as the CPU build, which is a tenth of the size. If pip's own configuration
does not give it, set MOTIONGEN_TORCH_INDEX to the package index that PyTorch's installation page names for CPU wheels.
"""

from __future__ import annotations

import os
import shutil

import nox

nox.options.sessions = ["tests", "lint", "types"]
nox.options.reuse_existing_virtualenvs = True
nox.options.default_venv_backend = "virtualenv"
nox.needs_version = ">=2024.10.9"

TORCH = "torch>=2.4,<2.14"


def install(session: nox.Session, *extras: str) -> None:
    """Torch first, from the index that was chosen for it, then motiongen as an editable install."""
    index = os.environ.get("MOTIONGEN_TORCH_INDEX")
    if index and shutil.which("nvidia-smi") is None:
        session.install(TORCH, "--index-url", index)
    session.install("-e", f".[{','.join(extras)}]" if extras else ".")


@nox.session
def marionette(session: nox.Session) -> None:
    """Train MARIONET on the built-in data, evaluate it and render what it generates. Arguments are passed on."""
    install(session)
    session.run("python", "-m", "motiongen", "+experiment=marionette", *session.posargs)


@nox.session
def tests(session: nox.Session) -> None:
    """Run the tests, those of one file in one process; arguments go to pytest."""
    install(session, "dev")
    session.run("pytest", "--numprocesses=auto", "--dist=loadfile", *session.posargs)


@nox.session
def fuzz(session: nox.Session) -> None:
    """Give every reader 10,000 damaged files and list its messages, for an hour or two; arguments go to pytest."""
    install(session, "dev")
    often = {"MOTIONGEN_FUZZ_EXAMPLES": "10000"}
    session.run("pytest", "tests/hostile", "--hypothesis-show-statistics", *session.posargs, env=often)


@nox.session
def lint(session: nox.Session) -> None:
    """Check the style of all code."""
    session.install("ruff>=0.8")
    session.run("ruff", "check", ".")
    session.run("ruff", "format", "--check", ".")


@nox.session
def types(session: nox.Session) -> None:
    """Check the types of the core and of the built-in plugins."""
    install(session, "dev")
    session.run("mypy")


@nox.session
def benchmarks(session: nox.Session) -> None:
    """Measure against plain reference code and write docs/performance.md; row names measure those and write no page."""
    install(session, "dev")
    everything = ("--page", "docs/performance.md", "--tracker", "mlflow")
    session.run("python", "-m", "benchmarks", *(session.posargs or everything))
