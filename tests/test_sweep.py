# SPDX-License-Identifier: Apache-2.0
"""`towtank sweep` as a user runs it: killed and started again, on a cluster, on bad input."""

from __future__ import annotations

import contextlib
import json
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import psutil
import pyarrow.parquet as pq
import pytest
from towtank_command import TOWTANK, run_towtank

STUDY = """\
name: seven
description: Seven lengths of the secondary cable.
rig: wu_chwang_2001
parameters:
  - {path: lines.secondary.length, range: [1.0, 2.0]}
design: {kind: latin_hypercube, samples: 7, seed: 2}
simulation: {settling_time: 20 s, periods: 2}
"""


@pytest.fixture(scope="module")
def study(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("study") / "study.yaml"
    path.write_text(STUDY)
    return path


@pytest.fixture(scope="module")
def whole(study) -> tuple[Path, subprocess.CompletedProcess[str]]:
    """The study run in one go by two processes."""
    out = study.parent / "whole"
    return out, run_towtank("sweep", study, "--out", out, "--workers", 2, "--json")


def table(out: Path) -> dict[str, list]:
    return pq.read_table(out / "results.parquet").to_pydict()


def wait_for(condition, what: str, seconds: float = 120.0):
    end = time.monotonic() + seconds
    while not (found := condition()):
        assert time.monotonic() < end, f"{what} did not come"
        time.sleep(0.02)
    return found


def test_json_and_results(whole):
    out, run = whole
    assert run.returncode == 0, run.stderr
    summary = json.loads(run.stdout)
    assert summary == json.loads((out / "summary.json").read_text())
    assert summary["samples"] == 7
    assert summary["failed"] == 0
    assert table(out)["sample"] == list(range(7))


def test_goes_on_after_kill_9(study, whole, tmp_path):
    out = tmp_path / "o"
    command = [*TOWTANK, "sweep", str(study), "--out", str(out), "--workers", "1"]
    journal = out / "journal.jsonl"
    process = psutil.Popen(command, stderr=subprocess.DEVNULL)
    try:
        wait_for(lambda: journal.exists() and journal.read_bytes().count(b"\n") > 1, "a result")
        workers = process.children(recursive=True)
        process.kill()
        process.wait()
    finally:
        if process.is_running():
            process.kill()
    assert not (out / "results.parquet").exists()
    _, alive = psutil.wait_procs(workers, timeout=30)
    assert not alive  # they noticed
    kept = journal.read_text().splitlines()[1:-1]  # the last line may be cut short
    # What is there is not computed again: a mark in it must come through.
    marked = {json.loads(line)["sample"] for line in kept}
    journal.write_text(journal.read_text().replace('"error": null', '"error": "kept"'))
    run = run_towtank("sweep", study, "--out", out, "--workers", 1)
    assert run.returncode == 0, run.stderr
    resumed, straight = table(out), table(whole[0])
    errors = resumed.pop("error")
    assert all(errors[sample] == "kept" for sample in marked)
    assert errors.count(None) >= 1
    straight.pop("error")
    assert resumed == straight  # exactly


@contextlib.contextmanager
def cluster(folder: Path, workers: int) -> Iterator[str]:
    """A Dask scheduler with workers, each a process of its own; yields the address."""
    file = folder / "scheduler.json"
    common = ["--scheduler-file", str(file), "--no-dashboard"]
    scheduler = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--port", "0", *common]
    worker = [sys.executable, "-m", "distributed.cli.dask_worker", "--nthreads", "1", "--no-nanny"]
    with contextlib.ExitStack() as stack:

        def start(command: list[str]) -> None:
            process = subprocess.Popen(command, stderr=subprocess.DEVNULL, cwd=folder)
            stack.callback(process.wait)
            stack.callback(process.terminate)

        start([*scheduler, "--host", "127.0.0.1"])
        address = wait_for(lambda: file.exists() and file.read_text(), "the scheduler")
        for _ in range(workers):
            start([*worker, *common, "--host", "127.0.0.1"])
        yield json.loads(address)["address"]


def test_dask_gives_exactly_the_local_results(study, whole, tmp_path):
    with cluster(tmp_path, workers=2) as address:
        out = tmp_path / "o"
        run = run_towtank("sweep", study, "--out", out, "--scheduler", address)
    assert run.returncode == 0, run.stderr
    assert table(out) == table(whole[0])


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["none.yaml"], ["none.yaml", "No such file"]),
        (["{study}", "--scheduler", "tcp://127.0.0.1:9"], ["no Dask scheduler"]),
    ],
)
def test_bad_input_is_one_line(study, tmp_path, arguments, words):
    arguments = [argument.format(study=study) for argument in arguments]
    run = run_towtank("sweep", *arguments, "--out", tmp_path / "o")
    assert run.returncode == 1
    last = run.stderr.strip().splitlines()[-1]
    assert last.startswith("towtank: error: ")
    assert "Traceback" not in run.stderr
    for word in words:
        assert word in last
