"""Evaluates policies with the program evalbus."""

import contextlib
import dataclasses
import json
import os
import pathlib
import re
import tempfile
from typing import Any, Callable, Dict, Iterator, List, Optional, Union

import numpy as np

from evalbus.errors import ActionError, InputError, PolicyError, ProgramError, check_sent_action_type
from evalbus.program import Program, check_task, words
from evalbus.runs import Episode, Run, read_run

# Version of the events of `evalbus run --json` (docs/schema/event.json).
_EVENTS_VERSION = 1
_CALLABLE_CONTRACT = "plain"
# Part of the program's error if the shape of an answer contradicts the contract. The server's address follows it.
_CONTRADICTION = "the contract contradicts the answer of the server at "

Policy = Union[str, os.PathLike, Callable]


@dataclasses.dataclass(frozen=True)
class Event:
    """An event of an active run (docs/schema/event.json)."""

    # "begin", "episode_begin", "partial", "episode", "remark" or "summary"; for plans also "plan_begin" and
    # "plan_summary".
    kind: str
    # The other keys of the event.
    content: Dict[str, Any] = dataclasses.field(repr=False)
    # The finished episode if kind is "episode".
    episode: Optional[Episode] = None


class _Active:
    """An active evaluation."""

    def __init__(self, arguments: List[str], serving=None):
        self._serving = serving
        self._program: Optional[Program] = None
        # Maps the folder of each run to its event "begin", in the order in which the runs began.
        self._folders: Dict[pathlib.Path, Dict[str, Any]] = {}
        self._is_finished = self._is_closed = False
        try:
            self._program = Program(arguments)
        except BaseException:
            self.close()
            raise

    def __enter__(self):
        return self

    def __exit__(self, *_) -> None:
        self.close()

    def __iter__(self) -> Iterator[Event]:
        return self

    def __next__(self) -> Event:
        """Returns the next event. Raises an EvalbusError if the run fails."""
        if self._is_finished:
            raise StopIteration
        if self._is_closed:
            raise ProgramError("the run was stopped before its end")
        try:
            line = self._program.output.readline()
            self._check_policy()
            if line:
                event = _event(line)
                if event.kind == "begin":
                    self._folders[pathlib.Path(event.content["run"])] = event.content
                self._check_answers(event)
                return event
            self._finish()
        except BaseException:
            self.close()
            raise
        self._is_finished = True
        self.close()
        raise StopIteration

    def _wait(self) -> List[Run]:
        for _ in self:
            pass
        return [read_run(folder) for folder in self._folders]

    def close(self) -> None:
        """Stops the run if it is active."""
        self._is_closed = True
        if self._program:
            self._program.close()
        if self._serving:
            self._serving.close()

    def _finish(self) -> None:
        try:
            self._program.finish()
        except InputError as error:
            contradiction = str(error).partition(_CONTRADICTION)[2]
            if not self._serving or not contradiction:
                # The program advises to add an option of its command line.
                raise InputError(str(error).replace("add --resume", "add resume=True")) from None
            # The server's address is omitted, because the user passed a function and knows of no server.
            raise ActionError(f"the policy contradicts its contract: {contradiction.partition(': ')[2]}") from None

    def _check_answers(self, event: Event) -> None:
        """Raises an error for an episode that is invalid because of the answers of a function. The program attributes
        them to a server, and would exclude the episode from the rate."""
        if not self._serving or not event.episode or event.episode.end_reason != "server_error":
            return
        detail = event.episode.line["end_detail"]
        kind = ActionError if "the contract expects" in detail else PolicyError
        raise kind(f"the policy failed in episode {event.episode.index}: {detail}")

    def _check_policy(self) -> None:
        error = self._serving.error if self._serving else None
        if isinstance(error, ActionError):
            raise error
        if error:
            text = f": {error}" if str(error) else ""
            raise PolicyError(f"the policy raised {type(error).__name__}{text}") from error


class ActiveRun(_Active):
    """An active run. Iterate over its events, or wait() for its result; leave the context to stop it."""

    @property
    def folder(self) -> Optional[pathlib.Path]:
        """Folder of the run; None before the event "begin"."""
        return next(iter(self._folders), None)

    def wait(self) -> Run:
        """Waits for the end of the run, and returns it. Raises an EvalbusError if the run fails."""
        return self._wait()[0]


class ActivePlan(_Active):
    """An active plan. Iterate over its events, or wait() for its results; leave the context to stop it."""

    _plan: Dict[str, Any] = {}

    def __next__(self) -> Event:
        event = super().__next__()
        if event.kind == "plan_begin":
            self._plan = event.content
        elif not self._plan:
            self.close()
            raise InputError("start_plan: expected a plan, a YAML file with 'policies' and 'tasks' (docs/plans.md); "
                             "evalbus.start() evaluates a task")  # fmt: skip
        return event

    def wait(self) -> List[Run]:
        """Waits for the end of the plan, and returns its runs: one per policy and task, in the order of the plan.
        Raises an EvalbusError if the plan fails."""
        return sorted(self._wait(), key=self._place)

    def _place(self, run: Run):
        # Workers begin runs in any order. The name of a task from a file differs between the plan and the run.
        begin = self._folders[run.folder]
        tasks = self._plan["tasks"]
        place = tasks.index(run.task) if run.task in tasks else len(tasks)
        return self._plan["policies"].index(begin["policy"]), place, run.folder.name


def start_plan(plan: Union[str, os.PathLike], **options) -> ActivePlan:
    """Starts a plan (docs/plans.md). options: options of `evalbus run PLAN`, such as workers=2 and out="results"."""
    return ActivePlan(["run", os.fspath(plan), "--json", "--quiet", *words(options)])


def start(
    task: str,
    policy: Policy = "expert",
    *,
    contract: Union[str, os.PathLike, None] = None,
    episodes: int = 10,
    seed: int = 0,
    out: Union[str, os.PathLike, None] = None,
    **options,
) -> ActiveRun:
    """Starts an evaluation. Takes the arguments of run()."""
    check_task(task)
    for name, number in (("episodes", episodes), ("seed", seed)):
        # words() would convert True to a flag, and omit False.
        if isinstance(number, (bool, np.bool_)):
            raise InputError(f"{name}: expected a whole number, got {number!r}")
    if str(task).split("/")[-1] == "all":
        raise InputError(f"task '{task}': expected one task")
    serving = None
    if callable(policy):
        from evalbus.server import Serving

        # The program identifies a server by its address, and resumes a run only with the same policy.
        port = _port_of(out) if options.get("resume") and out is not None else 0
        serving = Serving(_checked(policy), port=port)
        policy, contract = serving.url, contract or _CALLABLE_CONTRACT
    elif not isinstance(policy, (str, os.PathLike)):
        raise InputError(
            f"policy: expected a function, a class, a name, a contract or an address, got {type(policy).__name__}"
        )
    more = {"contract": contract, "episodes": episodes, "seed": seed, "out": out, **options}
    return ActiveRun(
        ["run", str(task), "--json", "--quiet", "--policy", os.fspath(policy), *words(more)], serving
    )


def _port_of(folder) -> int:
    """Returns the port at which the function of an interrupted run was served; 0 if the run has no function."""
    try:
        recorded = str(json.loads(pathlib.Path(os.fspath(folder), "run.json").read_bytes())["policy"])
    except (OSError, ValueError, KeyError, TypeError):
        return 0  # The program reports what is wrong with the folder.
    found = re.fullmatch(r"ws://127\.0\.0\.1:(\d{1,5})", recorded)
    return int(found[1]) if found else 0


def run(
    task: str,
    policy: Policy = "expert",
    *,
    contract: Union[str, os.PathLike, None] = None,
    episodes: int = 10,
    seed: int = 0,
    out: Union[str, os.PathLike, None] = None,
    **options,
) -> Run:
    """Evaluates a policy on a task, and returns the result.

    task: "lift_pot/position", as for `evalbus run`.
    policy: a function or class as for serve(), which is called in a thread of this process; the name of a policy
    or contract; a contract file; or the address of a server.
    contract: contract of a function or an address: a name or a file. Default for a function: "plain".
    seed: equal seeds give equal episodes. out: folder of the run, which must not exist; default: a new folder in runs/.
    options: other options of `evalbus run`: workers=2, video=["head"], control_hz=50, in_process=True, resume=True.

    Raises InputError for wrong arguments, ActionError and PolicyError for a function that fails, and ProgramError.
    """
    with start(task, policy, contract=contract, episodes=episodes, seed=seed, out=out, **options) as active:
        return active.wait()


@dataclasses.dataclass(frozen=True)
class Comparison:
    """Result of compare(), which states whether the run differs from the baseline."""

    # The result in one or two sentences.
    verdict: str
    # Difference of the success rates (run minus baseline) and its 95 % interval; None if no episode is complete.
    difference: Optional[float]
    difference_95: Any
    # p of the test of equal success rates, e.g. the exact McNemar test for pairs of equal seeds.
    p: Optional[float]
    # Entries of the task's "metrics" in `evalbus compare --json`, by metric; empty for several tasks.
    metrics: Dict[str, Dict[str, Any]] = dataclasses.field(repr=False)
    # The whole output of `evalbus compare --json`.
    content: Dict[str, Any] = dataclasses.field(repr=False)


def compare(baseline: Union[Run, str, os.PathLike], run: Union[Run, str, os.PathLike]) -> Comparison:
    """Tests whether a run differs from the baseline, which comes first, as in `evalbus compare`. Raises InputError if
    they are not comparable."""
    folders = [str(one.folder if isinstance(one, Run) else one) for one in (baseline, run)]
    with tempfile.TemporaryDirectory() as scratch:
        file = pathlib.Path(scratch) / "comparison.json"
        with contextlib.closing(Program(["compare", "--json", file, "--", *folders])) as program:
            program.output.read()
            program.finish()
        content = json.loads(file.read_bytes())
    (comparison,) = content["comparisons"]
    success = comparison["success"]
    tasks = comparison["tasks"]
    return Comparison(
        verdict=comparison["verdict"],
        difference=success["difference"],
        difference_95=tuple(success["difference_95"]),
        p=success["p"],
        metrics=tasks[0]["metrics"] if len(tasks) == 1 else {},
        content=content,
    )


def _event(line: bytes) -> Event:
    try:
        content = json.loads(line)
        version, kind = content.pop("schema_version"), content.pop("event")
    except (ValueError, KeyError, AttributeError) as error:
        raise ProgramError(f"evalbus run --json printed no event: {line[:200]!r}: {error}") from None
    if version != _EVENTS_VERSION:
        raise ProgramError(f"the program evalbus has events of version {version}, this package has {_EVENTS_VERSION}")
    return Event(kind, content, Episode.of(content["result"]) if kind == "episode" else None)


def _checked(policy: Callable) -> Callable:
    """Returns the policy, wrapped so that it raises ActionError for actions that are not numbers. The program ends an
    episode with policy_error if a number is not finite, as for any other policy."""

    def check(answer):
        if isinstance(answer, dict) and "actions" not in answer:
            raise ActionError(f'the policy returned a dictionary without "actions": {", ".join(map(str, answer))}')
        given = answer["actions"] if isinstance(answer, dict) else answer
        try:
            actions = np.asarray(given)
        except ValueError as error:  # rows of different lengths
            raise ActionError(f"the policy returned an action that is not an array: {error}") from None
        check_sent_action_type(actions, "the policy returned an action")
        return answer

    if isinstance(policy, type):
        return type(policy.__name__, (policy,), {"__call__": lambda self, seen: check(policy.__call__(self, seen))})

    class Checked:
        def __call__(self, observation):
            return check(policy(observation))

    checked = Checked()
    if hasattr(policy, "reset"):
        checked.reset = policy.reset
    return checked
