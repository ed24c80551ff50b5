"""Reader for run folders (docs/run_folder.md)."""

import json
import pathlib

import numpy as np


def read_run(folder):
    """Reads a finished, interrupted or active run. Returns a dictionary:

    ["run"]       options: the content of run.json
    ["summary"]   rates and statistics: the content of summary.json; None while the run is active
    ["episodes"]  one dictionary per finished episode, in order: the lines of episodes.jsonl
    ["scores"]    name -> array with one value per finished episode; nan if unavailable. Names of nested values
                  are joined by dots, as in `evalbus export`: "extended.min_clearance_m",
                  "parameters.pot_x_m" (a randomized initial condition)
    ["logs"]      episode -> path of its log, for read_log

    Rates include only episodes whose "complete" is true. Raises ValueError, with file and line, if the folder is not
    a valid run.
    """
    folder = pathlib.Path(folder)
    if (folder / "suite.json").exists():
        runs = _json(folder / "suite.json")["runs"]
        raise ValueError(f"{folder} is a suite; read one of its runs: {', '.join(runs)}")
    if not (folder / "run.json").exists():
        raise ValueError(f"{folder} is no run: it has no run.json")
    summary = folder / "summary.json"
    episodes = _episodes(folder / "episodes.jsonl")
    return {
        "run": _json(folder / "run.json"),
        "summary": _json(summary) if summary.exists() else None,
        "episodes": episodes,
        "scores": _scores(episodes),
        "logs": {e["episode"]: _log_in(_episode_folder(folder, e["episode"])) for e in episodes},
    }


def _episode_folder(run, episode):
    group = [] if episode < 10_000 else [f"{episode // 10_000}xxxx"]
    return run.joinpath("episodes", *group, f"{episode:04}")


def _log_in(episode_folder):
    log = episode_folder / "events.lcmlog"
    packed = episode_folder / "events.lcmlog.zst"  # evalbus run --log zstd
    return packed if packed.exists() else log


def _json(file):
    try:
        return json.loads(file.read_bytes())
    except ValueError as error:
        raise ValueError(f"{file}: {error}") from None


def _episodes(file):
    lines = file.read_bytes().split(b"\n")
    episodes = {}
    for number, line in enumerate(lines, 1):
        if not line and number == len(lines):
            break
        try:
            episode = json.loads(line)
            index = episode["episode"]
        except (ValueError, TypeError, KeyError) as error:
            if number == len(lines):
                break  # The last line is truncated: the run was killed while writing it.
            raise ValueError(f"{file}:{number}: no line of an episode: {error}") from None
        if index in episodes:
            raise ValueError(f"{file}:{number}: episode {index} again")
        episodes[index] = episode
    return [episodes[index] for index in sorted(episodes)]


def _scores(episodes):
    rows = []
    for episode in episodes:
        rows.append(dict(_numbers(episode.get("parameters", {}), "parameters.")))
        rows[-1].update(_numbers(episode["metrics"], ""))
        rows[-1].update(_numbers(episode["extended"], "extended."))
    names = dict.fromkeys(name for row in rows for name in row)
    return {name: np.array([row.get(name, np.nan) for row in rows], dtype=float) for name in names}


def _numbers(values, prefix):
    for key, value in values.items():
        if isinstance(value, dict):
            yield from _numbers(value, f"{prefix}{key}.")
        elif isinstance(value, (int, float)):
            yield prefix + key, value
