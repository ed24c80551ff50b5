"""Writes a run as a log of Inspect (inspect_ai), with its own writer: each complete episode is a sample."""

import datetime
import os
import pathlib

from evalbus.command import parser, run_module
from evalbus.errors import InputError
from evalbus.runs import Run, check_finished, read_run
from evalbus.trackers import run_id


def write_log(folder, out) -> None:
    """Writes a log to the new file `out`, FILE.eval or FILE.json."""
    from inspect_ai.log import write_eval_log

    out = pathlib.Path(out)
    if out.suffix not in (".eval", ".json"):
        raise InputError(f"{out}: expected a name that ends with .eval or .json")
    if out.exists():
        raise InputError(f"{out}: exists; choose another name")
    run = read_run(folder)
    check_finished(run)
    # The file is written under a temporary name and renamed when it is complete. Inspect derives the format from the
    # name's ending.
    coming = out.with_name(f".{out.stem}.{os.getpid()}.tmp{out.suffix}")
    try:
        write_eval_log(_log(run), str(coming))
        coming.rename(out)
    finally:
        coming.unlink(missing_ok=True)


def _log(run: Run):
    from inspect_ai.log import EvalConfig, EvalDataset, EvalLog, EvalMetric, EvalResults, EvalSample, EvalScore, EvalSpec
    from inspect_ai.scorer import Score

    summary, episodes = run.summary, [episode for episode in run.episodes if episode.complete]
    ended = datetime.datetime.fromtimestamp((run.folder / "summary.json").stat().st_mtime, datetime.timezone.utc)
    lower, upper = summary.success_rate_95
    metrics = {
        "accuracy": summary.success_rate,
        "wilson_95_lower": lower,
        "wilson_95_upper": upper,
        **{f"mean_{name}": metric.mean for name, metric in summary.metrics.items()},
    }
    return EvalLog(
        status="success",
        eval=EvalSpec(
            eval_id=run_id(run),
            run_id=run_id(run),
            task_id=run_id(run),
            task=run.task,
            task_version=run.options["task_sha256"],
            created=ended.isoformat(),
            dataset=EvalDataset(
                name=run.task, samples=len(episodes), sample_ids=[episode.index for episode in episodes]
            ),
            model=f"evalbus/{run.options['policy_name'] or run.options['policy']}",
            config=EvalConfig(epochs=1),
            packages={"evalbus": run.options["evalbus_version"]},
            metadata=run.options,
        ),
        results=EvalResults(
            total_samples=len(run.episodes),
            completed_samples=len(episodes),
            scores=[
                EvalScore(
                    name="success",
                    scorer="evalbus",
                    metrics={
                        name: EvalMetric(name=name, value=value) for name, value in metrics.items() if value is not None
                    },
                )
            ],
        ),
        samples=[
            EvalSample(
                id=episode.index,
                epoch=1,
                input=f"{run.task}, seed {episode.seed}",
                target="success",
                scores={
                    "success": Score(
                        value=int(episode.success),
                        answer=episode.end_reason,
                        explanation=episode.cause.get("text", episode.failure_reason),
                        metadata=episode.scores(),
                    )
                }
                if episode.judged
                else None,
                metadata=episode.line,
            )
            for episode in episodes
        ],
    )


def main():
    options = parser(__doc__, "evalbus export --inspect")
    options.add_argument("run", help="folder of a run")
    options.add_argument("--inspect", required=True, help="file to write, FILE.eval or FILE.json")
    given = options.parse_args()
    write_log(given.run, given.inspect)
    print(given.inspect)


if __name__ == "__main__":
    run_module(main)
