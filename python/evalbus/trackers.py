"""Sends a run, or each run of a suite, to an experiment tracker, through its own installed package.

Writes the run's options as the tracker's configuration (not TensorBoard), the numbers of each complete episode at the
step that is the episode's index, and success rate and means of metrics as the summary. A run has the same id whenever
it is sent: sending it again, for example after --resume, adds the episodes after the last one sent, because steps of
wandb and trackio only increase (MLflow: all missing ones; TensorBoard: writes the files again). Server addresses, keys
and offline modes are set as the tracker's own documentation describes.
"""

import hashlib
import importlib
import json
import pathlib
from typing import Dict

from evalbus.command import parser, run_module
from evalbus.errors import InputError
from evalbus.runs import Episode, Run, read_runs

# Keys of run.json that may differ when a run is resumed, so that they are not part of its id.
_VARIABLE = {
    *("episodes", "only", "until", "workers", "url", "in_process", "by_hand", "video", "log", "model_path", "assets", "task_path"),
    *("git_dirty", "renderer", "renderer_warning", "run_id", "scene_warnings"),
}


def run_id(run: Run) -> str:
    """Returns the id of a run in every tracker. It is equal for equal folder names and equal options that --resume requires."""
    options = {key: value for key, value in run.options.items() if key not in _VARIABLE}
    text = json.dumps([run.folder.absolute().name, options], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def to_wandb(run: Run, project: str, module: str = "wandb") -> None:
    """module: "wandb", or "trackio", which has the same functions. The summary is logged with the last episode."""
    tracker = importlib.import_module(module)
    folder = run.folder.absolute().name
    # In Trackio, the name of a run is also its id.
    identity = {"name": f"{folder}-{run_id(run)}"} if module == "trackio" else {"name": folder, "id": run_id(run)}
    active = tracker.init(project=project, resume="allow", config=_flat(run.options), **identity)
    try:
        # Trackio has no public attribute for the next step.
        first = active._next_step if module == "trackio" else active.step
        new = [episode for episode in _complete(run) if episode.index >= first]
        for episode in new:
            values = _values(episode)
            if episode is new[-1]:
                values |= {f"summary/{key}": value for key, value in _summary(run).items()}
            tracker.log(values, step=episode.index)
    finally:
        tracker.finish()


def to_trackio(run: Run, project: str) -> None:
    to_wandb(run, project, "trackio")


def to_mlflow(run: Run, experiment: str) -> None:
    import mlflow

    mlflow.set_experiment(experiment)
    found = mlflow.search_runs(
        experiment_names=[experiment], filter_string=f"tags.evalbus_id = '{run_id(run)}'", output_format="list"
    )
    is_known = {"run_id": found[0].info.run_id} if found else {}
    with mlflow.start_run(run_name=run.folder.absolute().name, tags={"evalbus_id": run_id(run)}, **is_known) as active:
        if not found:
            mlflow.log_params(_flat(run.options))
        client = mlflow.MlflowClient()
        # Episodes without a verdict have no "success".
        sent = {point.step for point in client.get_metric_history(active.info.run_id, "completion_time")}
        for episode in _complete(run):
            if episode.index not in sent:
                mlflow.log_metrics(_values(episode), step=episode.index)
        mlflow.log_metrics({f"summary.{key}": value for key, value in _summary(run).items()})


def to_tensorboard(run: Run, folder: str) -> None:
    from tensorboard.summary import Writer

    directory = pathlib.Path(folder) / f"{run.folder.absolute().name}-{run_id(run)}"
    # Old event files are deleted, because TensorBoard has no other way to replace points.
    for old in directory.glob("events.out.tfevents.*"):
        old.unlink()
    writer = Writer(str(directory))
    for episode in _complete(run):
        for key, value in _values(episode).items():
            writer.add_scalar(key, value, episode.index)
    for key, value in _summary(run).items():
        writer.add_scalar(f"summary/{key}", value, 0)
    writer.close()


_TRACKERS = {"wandb": to_wandb, "trackio": to_trackio, "mlflow": to_mlflow, "tensorboard": to_tensorboard}


def _complete(run: Run):
    return [episode for episode in run.episodes if episode.complete]


def _values(episode: Episode) -> Dict[str, float]:
    return {key: float(value) for key, value in episode.scores().items()}


def _summary(run: Run) -> Dict[str, float]:
    if not run.summary or run.summary.success_rate is None:
        return {}
    rates = {"success_rate": run.summary.success_rate, "complete_episodes": float(run.summary.complete)}
    return {**rates, **{f"mean_{name}": metric.mean for name, metric in run.summary.metrics.items()}}


def _flat(options: dict) -> Dict[str, str]:
    return {key: value if isinstance(value, (str, int, float)) else json.dumps(value) for key, value in options.items()}


def main():
    options = parser(__doc__, "evalbus export")
    options.add_argument("run", help="folder of a run or a suite")
    for name in _TRACKERS:
        what = "folder for event files" if name == "tensorboard" else "name of the project or experiment"
        options.add_argument(f"--{name}", help=what)
    given = vars(options.parse_args())
    chosen = [name for name in _TRACKERS if given[name]]
    if len(chosen) != 1:
        raise InputError(f"expected one of {', '.join(f'--{name}' for name in _TRACKERS)}")
    for run in read_runs(given["run"]):
        _TRACKERS[chosen[0]](run, given[chosen[0]])
        print(f"{run.folder}: {chosen[0]} {given[chosen[0]]}, id {run_id(run)}")


if __name__ == "__main__":
    run_module(main)
