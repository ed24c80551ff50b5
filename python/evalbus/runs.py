"""Reader for run folders (docs/run_folder.md)."""

import dataclasses
import difflib
import functools
import json
import operator
import pathlib
import warnings
from typing import Any, Dict, List, Optional, Tuple

import numpy as np

from evalbus.errors import EvalbusError, InputError

Interval = Tuple[Optional[float], Optional[float]]
# schema_version of run folders (docs/versioning.md).
_VERSION = 1
# failure_reason of an episode without a verdict, whose metrics have no "success".
_NOT_JUDGED = "not_judged"


@dataclasses.dataclass(frozen=True)
class Episode:
    """A finished episode, from its line of episodes.jsonl."""

    index: int
    seed: int
    # False also if the episode has no verdict (`judged`).
    success: bool
    # Only complete episodes count in rates.
    complete: bool
    end_reason: str
    # The reason for the failure; empty if the episode succeeded.
    failure_reason: str
    # metrics: RoboEval's dictionary. extended: evalbus' own metrics. parameters: the randomized start parameters.
    metrics: Dict[str, Any]
    extended: Dict[str, Any]
    parameters: Dict[str, float]
    # Poses of wrists and objects at the end of the episode (docs/run_folder.md); empty in runs of older versions.
    final_poses: Dict[str, Dict[str, float]]
    # Decisive moment: "kind", "time_s", "text" (docs/failures.md); empty in runs of older versions.
    cause: Dict[str, Any]
    # The whole line of episodes.jsonl.
    line: Dict[str, Any] = dataclasses.field(repr=False)

    @staticmethod
    def of(line: Dict[str, Any]) -> "Episode":
        for key in ("metrics", "extended", "parameters", "final_poses", "cause"):
            if not isinstance(line.get(key, {}), dict):
                raise TypeError(f"{key}: expected an object")
        is_judged = line["failure_reason"] != _NOT_JUDGED
        return Episode(
            index=operator.index(line["episode"]),
            seed=line["seed"],
            success=is_judged and line["metrics"]["success"] == 1,
            complete=line["complete"],
            end_reason=line["end_reason"],
            failure_reason=line["failure_reason"],
            metrics=line["metrics"],
            extended=line["extended"],
            parameters=line.get("parameters", {}),
            final_poses=line.get("final_poses", {}),
            cause=line.get("cause", {}),
            line=line,
        )

    @property
    def judged(self) -> bool:
        """True if the episode has a verdict. Without one, it counts in no success rate."""
        return self.failure_reason != _NOT_JUDGED

    def scores(self) -> Dict[str, float]:
        """Returns all numbers by name. Names of nested values are joined by dots, as in `evalbus export`:
        "extended.min_clearance_m", "parameters.pot_x_m"."""
        return {
            **dict(_numbers(self.parameters, "parameters.")),
            **dict(_numbers(self.metrics, "")),
            **dict(_numbers(self.extended, "extended.")),
            **dict(_numbers(self.final_poses, "final_poses.")),
        }


@dataclasses.dataclass(frozen=True)
class Metric:
    """Statistics of a metric over the complete episodes that have it."""

    episodes: int
    mean: float
    mean_95: Interval
    std: Optional[float]
    median: float
    p5: float
    p95: float
    min: float
    max: float


@dataclasses.dataclass(frozen=True)
class Summary:
    """Content of summary.json. Rates and metrics cover complete episodes, rates only those with a verdict."""

    episodes: int
    complete: int
    successes: int
    success_rate: Optional[float]
    # Wilson's 95 % interval.
    success_rate_95: Interval
    failure_reasons: Dict[str, int]
    # Sentences to read with the rates, for example that successes did not reach every stage.
    notes: List[str]
    metrics: Dict[str, Metric] = dataclasses.field(repr=False)
    # Contents of the whole file.
    content: Dict[str, Any] = dataclasses.field(repr=False)

    @staticmethod
    def of(content: Dict[str, Any]) -> "Summary":
        names = [field.name for field in dataclasses.fields(Metric)]
        metrics = {
            name: Metric(**{key: _interval(value[key]) for key in names})
            for name, value in content["metrics"].items()
        }
        return Summary(
            episodes=content["episodes"],
            complete=content["complete"],
            successes=content["successes"],
            success_rate=content["success_rate"],
            success_rate_95=_interval(content["success_rate_wilson_95"]),
            failure_reasons=content["failure_reasons"],
            notes=content.get("notes", []),
            metrics=metrics,
            content=content,
        )

    @property
    def judged(self) -> int:
        """Number of complete episodes with a verdict."""
        return self.content.get("judged", self.complete)


class Scores(Dict[str, np.ndarray]):
    """Arrays by the name of a score. The error for an unknown name contains similar names."""

    def __missing__(self, name):
        similar = difflib.get_close_matches(str(name), self)
        text = f"did you mean {' or '.join(map(repr, similar))}?" if similar else "list(run.scores) has the names"
        raise KeyError(f"no score {name!r}; {text}")


@dataclasses.dataclass(frozen=True)
class Run:
    """A finished, interrupted or active run."""

    folder: pathlib.Path
    # Content of run.json.
    options: Dict[str, Any] = dataclasses.field(repr=False)
    # Statistics of the finished episodes; None while the run is active, and if it was killed.
    summary: Optional[Summary]
    # Finished episodes, in order.
    episodes: List[Episode] = dataclasses.field(repr=False)

    @property
    def task(self) -> str:
        return f"{self.options['task']}/{self.options['variation']}"

    @functools.cached_property
    def scores(self) -> "Scores":
        """Returns an array per score, by name, with one value for each finished episode; nan if the episode is
        incomplete or does not have this score."""
        rows = [episode.scores() if episode.complete else {} for episode in self.episodes]
        names = dict.fromkeys(name for row in rows for name in row)
        return Scores({name: np.array([row.get(name, np.nan) for row in rows], dtype=float) for name in names})

    @property
    def logs(self) -> Dict[int, pathlib.Path]:
        """Returns the path of each episode's log, for read_log()."""
        return {episode.index: _log_in(_episode_folder(self.folder, episode.index)) for episode in self.episodes}

    def to_pandas(self):
        """Returns a pandas DataFrame with one row of scores per episode. Raises EvalbusError if pandas is missing."""
        try:
            import pandas
        except ImportError:
            raise EvalbusError("to_pandas() requires pandas: pip install pandas") from None

        keys = ("index", "seed", "success", "complete", "end_reason", "failure_reason")
        rows = [{**{key: getattr(e, key) for key in keys}, **_renamed(e.scores())} for e in self.episodes]
        return pandas.DataFrame(rows).set_index("index") if rows else pandas.DataFrame(columns=keys[1:])


def check_finished(run: Run) -> None:
    """Raises InputError if the run was interrupted, or has no success rate. An interrupted run also has a summary."""
    if run.summary is None or run.summary.success_rate is None:
        raise InputError(f"{run.folder}: the run is not finished, or has no complete episode")
    if (run.folder / "collect.json").exists():
        raise InputError(f"{run.folder}: collected demonstrations: only successes were kept, so their rate is not the policy's")
    # The results decide when a run of a plan with `until` ends, and the operator may end `evalbus watch`.
    if run.options.get("until") or run.options.get("watch"):
        return
    planned = len(run.options.get("only") or []) or run.options.get("episodes", 0)
    if len(run.episodes) < planned:
        raise InputError(f"{run.folder}: the run is not finished: it has {len(run.episodes)} of {planned} episodes")


def read_run(folder) -> Run:
    """Reads a finished, interrupted or active run.

    Raises InputError, with file and line, if the folder is not a valid run.
    """
    folder = _path(folder)
    if not folder.exists():
        raise InputError(f"{folder}: no such run folder")
    if (folder / "suite.json").exists():
        raise InputError(f"{folder} is a suite; read one of its runs: {', '.join(_names_of_runs(folder))}")
    if not (folder / "run.json").exists():
        raise InputError(f"{folder} is not a run: it has no run.json")
    options, summary, episodes = _json(folder / "run.json"), folder / "summary.json", folder / "episodes.jsonl"
    # Runs of older versions have no schema_version.
    if options.get("schema_version", _VERSION) != _VERSION:
        raise InputError(
            f"{folder / 'run.json'}: the run folder has version {options['schema_version']}, this package reads {_VERSION}"
        )
    for key in ("task", "variation"):
        if not isinstance(options.get(key), str):
            raise InputError(f"{folder / 'run.json'}: {key}: expected a name")
    return Run(
        folder=folder,
        options=options,
        summary=_summary(summary) if summary.exists() else None,
        # The file does not exist before the first episode has finished.
        episodes=_episodes(episodes) if episodes.exists() or summary.exists() else [],
    )


def read_runs(folder) -> List[Run]:
    """Reads each run of a suite, or a single run. Raises the errors of read_run()."""
    folder = _path(folder)
    if not (folder / "suite.json").exists():
        return [read_run(folder)]
    return [read_run(folder / name) for name in _names_of_runs(folder)]


def _path(folder) -> pathlib.Path:
    try:
        return pathlib.Path(folder)
    except TypeError:
        raise InputError(f"expected the folder of a run, got {folder!r}") from None


def _names_of_runs(suite) -> List[str]:
    names = _json(suite / "suite.json").get("runs")
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise InputError(f"{suite / 'suite.json'}: runs: expected a list of folders")
    return names


def _summary(file) -> Summary:
    try:
        return Summary.of(_json(file))
    except (AttributeError, KeyError, TypeError) as error:
        raise InputError(f"{file}: not the summary of a run: {_reason(error)}") from None


def _interval(value):
    return tuple(value) if isinstance(value, list) else value


def _renamed(scores):
    # The metric "success" repeats the column of this name.
    return {name: value for name, value in scores.items() if name != "success"}


def _episode_folder(run, episode):
    group = [] if episode < 10_000 else [f"{episode // 10_000}xxxx"]
    return run.joinpath("episodes", *group, f"{episode:04}")


def _log_in(episode_folder):
    log = episode_folder / "events.lcmlog"
    packed = episode_folder / "events.lcmlog.zst"  # evalbus run --log zstd
    return packed if packed.exists() else log


def _bytes(file):
    try:
        return file.read_bytes()
    except OSError as error:
        raise InputError(f"{file}: {error.strerror}") from None


def _json(file):
    """Returns the JSON object in a file."""
    data = _bytes(file)
    try:
        content = json.loads(data)
    except (RecursionError, ValueError) as error:
        raise InputError(f"{file}: {error}") from None
    if not isinstance(content, dict):
        raise InputError(f"{file}: expected a JSON object")
    return content


def _reason(error):
    return f"it has no {error}" if isinstance(error, KeyError) else error


def _refuse_constant(name):
    raise ValueError(f"{name} is not a JSON number")


def _episodes(file):
    lines = _bytes(file).split(b"\n")
    episodes = {}
    for number, line in enumerate(lines, 1):
        if not line and number == len(lines):
            break
        try:
            episode = Episode.of(json.loads(line, parse_constant=_refuse_constant))
        except (RecursionError, ValueError, TypeError, KeyError, AttributeError) as error:
            if number == len(lines):  # The run is writing this line, or was killed while it wrote it.
                warnings.warn(f"{file}:{number}: the last line is truncated and ignored", stacklevel=4)
                break
            raise InputError(f"{file}:{number}: not the line of an episode: {_reason(error)}") from None
        if episode.index in episodes:
            raise InputError(f"{file}:{number}: a second line of episode {episode.index}")
        episodes[episode.index] = episode
    return [episodes[index] for index in sorted(episodes)]


def _numbers(values, prefix):
    for key, value in values.items():
        if isinstance(value, dict):
            yield from _numbers(value, f"{prefix}{key}.")
        elif isinstance(value, (int, float)):
            yield prefix + key, value
