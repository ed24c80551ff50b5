"""Writes the result of a run or a suite in the format of Hugging Face's community evaluations.

FOLDER/model/.eval_results/evalbus.yaml belongs in the repository of the policy, FOLDER/dataset/eval.yaml in the
repository of the benchmark's data set. The value is the success rate in percent; the notes have counts and interval.
"""

import json
import os
import pathlib
import shutil
from typing import List

from evalbus.command import parser, run_module
from evalbus.errors import InputError
from evalbus.runs import Run, check_finished, read_runs


def write_results(run, out, dataset: str) -> None:
    """Writes both files to the new folder `out`. dataset: id of the benchmark's data set, OWNER/NAME."""
    if dataset.count("/") != 1 or not all(dataset.split("/")):
        raise InputError(f"--dataset {dataset}: expected OWNER/NAME")
    runs = read_runs(run)
    out = pathlib.Path(out)
    if out.exists():
        raise InputError(f"{out}: exists; choose another name")
    for one in runs:
        successes = sum(episode.success for episode in one.episodes if episode.complete)
        if one.summary and (one.summary.episodes, one.summary.successes) != (len(one.episodes), successes):
            raise InputError(f"{one.folder}: summary.json and episodes.jsonl differ in their counts (see 'evalbus verify')")
        check_finished(one)
    # The folder is written under a temporary name and renamed when it is complete.
    coming = out.with_name(f".{out.name}.{os.getpid()}.tmp")
    try:
        results = [line for one in runs for line in _result(one, dataset)]
        _write(coming / "model" / ".eval_results" / "evalbus.yaml", results)
        _write(coming / "dataset" / "eval.yaml", _benchmark(runs, dataset))
        coming.rename(out)
    finally:
        shutil.rmtree(coming, ignore_errors=True)


def _result(run: Run, dataset: str) -> List[str]:
    summary = run.summary
    lower, upper = (100 * bound for bound in summary.success_rate_95)
    notes = (
        f"success rate in percent: {summary.successes} of {summary.judged} episodes, 95 % CI {lower:.1f} to {upper:.1f}, "
        f"seed {run.options['seed']}, evalbus {run.options['evalbus_version']}, MuJoCo {run.options['mujoco_version']}"
    )
    return [
        "- dataset:",
        f"    id: {_text(dataset)}",
        f"    task_id: {_text(_task_id(run))}",
        f"  value: {100 * summary.success_rate:.4g}",
        f"  notes: {_text(notes)}",
    ]


def _benchmark(runs: List[Run], dataset: str) -> List[str]:
    lines = [
        f"name: {_text(dataset.split('/')[1])}",
        f"description: {_text('Success rates of robot policies in tasks of evalbus.')}",
        # The Hub accepts only frameworks that huggingface.js lists.
        "evaluation_framework: evalbus",
        "tasks:",
    ]
    for task_id in dict.fromkeys(map(_task_id, runs)):
        lines += [f"  - id: {_text(task_id)}", "    config: default", "    split: test"]
    return lines


def _task_id(run: Run) -> str:
    return run.task.replace("/", "_")


def _text(value: str) -> str:
    # A JSON string is a YAML string.
    return json.dumps(value, ensure_ascii=False)


def _write(file: pathlib.Path, lines: List[str]) -> None:
    file.parent.mkdir(parents=True)
    file.write_text("\n".join([*lines, ""]), encoding="utf-8")


def main():
    options = parser(__doc__, "evalbus export --hf")
    options.add_argument("run", help="folder of a run or a suite")
    options.add_argument("--hf", required=True, help="folder to write")
    options.add_argument("--dataset", required=True, help="id of the benchmark's data set on the Hub, OWNER/NAME")
    given = options.parse_args()
    write_results(given.run, given.hf, given.dataset)
    print(given.hf)


if __name__ == "__main__":
    run_module(main)
