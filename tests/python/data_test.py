"""Input and output files with real programs: training sets read by h5py, trajectories written with NumPy,
invalid input.
"""
import json
import pathlib
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import time

try:
    import h5py
    import jsonschema
    import numpy
except ImportError:
    sys.exit(77)

from support import DEADLINE_S, SOURCE

BIN = pathlib.Path(sys.argv[1]) / "evalbus"


def evalbus(*arguments, code=0):
    done = subprocess.run([BIN, *map(str, arguments)], capture_output=True, text=True, timeout=DEADLINE_S)
    assert done.returncode == code, (arguments, done.returncode, done.stdout, done.stderr)
    return done.stdout + done.stderr


def lines(run):
    return [json.loads(line) for line in (run / "episodes.jsonl").read_text().splitlines()]


with tempfile.TemporaryDirectory() as name:
    here = pathlib.Path(name)
    run = here / "run"
    evalbus("run", "lift_pot/base", "--policy", "expert", "--episodes", "1", "--in-process", "--video", "none", "--out", run)

    # Tests robomimic's layout.
    evalbus("export", run, "--hdf5", here / "set.hdf5", "--camera", "head", "--size", "32x24")
    with h5py.File(here / "set.hdf5") as f:
        demo = f["data/demo_0"]
        steps = int(demo.attrs["num_samples"])
        assert f["data"].attrs["total"] == steps and json.loads(f["data"].attrs["env_args"])["env_type"] == 2
        actions, raw = demo["actions"][:], demo["actions_raw"][:]
        assert actions.shape == raw.shape == (steps, 16) and numpy.abs(actions).max() <= 1
        low, high = demo.attrs["action_min"], demo.attrs["action_max"]
        assert numpy.allclose((actions + 1) / 2 * (high - low) + low, raw, atol=1e-12)
        assert demo["obs/head_image"].shape == (steps, 24, 32, 3) and demo["obs/head_image"][0].std() > 5
        for key in demo["obs"]:
            assert (demo["obs"][key][1:] == demo["next_obs"][key][:-1]).all(), key
        assert demo["dones"][:].sum() == 1 and demo["rewards"][-1] == 1
        assert [s.decode() for s in f["mask/success"][:]] == ["demo_0"]
        joints, opening, pot = (demo["obs"][k][:] for k in ("joint_position", "gripper_opening", "pot_pose"))
        last = [demo["next_obs"][k][-1:] for k in ("joint_position", "gripper_opening", "pot_pose")]
        joints, opening, pot = (numpy.vstack(x) for x in zip((joints, opening, pot), last))
    assert "exists" in evalbus("export", run, "--hdf5", here / "set.hdf5", code=1)

    # Tests images. An interrupted export continues and gives the same result.
    several, images = here / "several", ["--camera", "head,left/hand/wrist", "--size", "96x64"]
    evalbus("run", "lift_pot/position", "--policy", "expert", "--episodes", "4", "--control-hz", "20", "--in-process",
            "--video", "none", "--out", several)  # fmt: skip
    evalbus("export", several, "--hdf5", here / "whole.hdf5", *images)
    kept = here / "stopped.hdf5.images"
    command = [BIN, "export", several, "--hdf5", here / "stopped.hdf5", *images]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as stopped:
        while stopped.poll() is None and not (kept.exists() and any(len(f.name) == 32 for f in kept.iterdir())):
            time.sleep(0.005)
        stopped.send_signal(signal.SIGINT)
        said = stopped.communicate(timeout=DEADLINE_S)[1]
    assert stopped.returncode == 2 and "run the same command again to continue" in said, (stopped.returncode, said)
    assert not (here / "stopped.hdf5").exists()
    begun = {f: f.stat().st_mtime_ns for f in kept.iterdir()}
    assert 1 <= len(begun) < 4 and all(len(f.name) == 32 for f in begun), begun
    evalbus(*command[1:])
    assert not kept.exists()
    # Each demo stores its initial state for `trained_on` of a contract. The other layout stores the same.
    starts = [{"task": "lift_pot/position", "parameters": line["parameters"]} for line in lines(several)]
    with h5py.File(here / "whole.hdf5") as f:
        assert [json.loads(line) for line in f["evalbus_starts"][:]] == starts
    evalbus("export", several, "--safetensors", here / "several_demos")
    text = (here / "several_demos/evalbus_starts.jsonl").read_text()
    assert [json.loads(line) for line in text.splitlines()] == starts and starts[0]["parameters"], text

    assert (here / "stopped.hdf5").read_bytes() == (here / "whole.hdf5").read_bytes()

    # Tests RoboEval's layout and the rule of its converter.
    evalbus("export", run, "--safetensors", here / "demos")
    demo = here / "demos" / "0000.safetensors"
    blob = demo.read_bytes()
    (length,) = struct.unpack("<Q", blob[:8])
    header = json.loads(blob[8 : 8 + length])
    begin, end = header["info_demo_action"]["data_offsets"]
    table = numpy.frombuffer(blob[8 + length + begin : 8 + length + end], "<f8").reshape(-1, 16)
    assert (table == raw).all()
    evalbus("demo", "convert", demo, "--hz", "10", "--out", here / "ten.csv", "--csv")
    ten = numpy.loadtxt(here / "ten.csv", delimiter=",", skiprows=1)
    padded = numpy.vstack([raw, numpy.repeat(raw[-1:], -len(raw) % 5, axis=0)]).reshape(-1, 5, 16)
    assert numpy.allclose(ten[:, 1:15], padded[:, :, :14].mean(1), atol=1e-12) and (ten[:, 15:] == padded[:, -1, 14:]).all()
    info = json.loads(evalbus("demo", "info", demo, "--json"))
    assert info["(not in a task's folder)"]["steps"] == steps
    jsonschema.validate(info, json.loads((SOURCE / "docs/schema/demo_info.json").read_text()))
    evalbus("run", "lift_pot/base", "--policy", f"demo:{demo}", "--episodes", "1", "--after-success-s", "0.5",
            "--in-process", "--video", "none", "--out", here / "played")  # fmt: skip
    said = evalbus("run", "lift_pot/base", "--policy", f"demo:{demo}", "--out", here / "never", code=1)
    assert said == f"error: --episodes 10: {demo} holds 1 demonstration; expected at most 1, because each episode replays one\n", said
    played, recorded = lines(here / "played")[0], lines(run)[0]
    assert played["metrics"]["completion_time"] == recorded["metrics"]["completion_time"], played
    assert played["extended"]["success_once"] == played["extended"]["success_end"] == 1, played["extended"]
    assert "its rate of 50 Hz is not a multiple of 7 Hz" in evalbus("demo", "convert", demo, "--hz", "7", "--out", here / "x", code=1)

    # Tests the run's own trajectory as a table. All available values agree.
    names = [f"{arm}/joint{k}" for arm in ("left", "right") for k in range(1, 8)]
    columns = [f"q{k}" for k in range(14)] + ["gl", "gr", "x", "y", "z", "qw", "qx", "qy", "qz"]
    map_text = "task: lift_pot/base\nrate_hz: 50\njoints:\n  unit: rad\n  columns: {" + ", ".join(
        f"{n}: {c}" for n, c in zip(names, columns)) + "}\n"
    map_text += "grippers:\n  left: {column: gl, open: 1, closed: 0}\n  right: {column: gr, open: 1, closed: 0}\n"
    poses = "objects:\n  pot: {position_m: [x, y, z], quaternion_wxyz: [qw, qx, qy, qz]}\n"
    (here / "map.yaml").write_text(map_text + poses)
    (here / "blind.yaml").write_text(map_text)
    data = numpy.hstack([joints, opening, pot])

    def write(file, table, head=columns):
        numpy.savetxt(file, table, delimiter=",", header=",".join(head), comments="", fmt="%.17g")
        return file

    table = write(here / "a.csv", data)
    evalbus("score", here / "map.yaml", table, "--out", here / "scored")
    original, scored = lines(run)[0], lines(here / "scored")[0]
    assert scored["metrics"]["success"] == original["metrics"]["success"] == 1
    for key in ("cartesian_path_length", "joint_path_length", "orientation_path_length"):
        for arm in ("left", "right"):
            a, b = original["metrics"][key][arm], scored["metrics"][key][arm]
            assert abs(a - b) < 1e-6 * max(1, abs(a)), (key, arm, a, b)
    assert scored["metrics"]["completion_time"] == original["metrics"]["completion_time"]
    assert "mechanical_work_J" not in scored["extended"] and "action_clips" not in scored["extended"]
    assert "bit-identical to the recorded ones" in evalbus("rescore", here / "scored")
    evalbus("report", here / "scored", "--out", here / "report.html")
    numpy.savez(here / "a.npz", **{c: data[:, k] for k, c in enumerate(columns)})
    evalbus("score", here / "map.yaml", here / "a.npz", "--out", here / "scored_npz")
    assert lines(here / "scored_npz")[0]["metrics"] == scored["metrics"]
    with h5py.File(here / "a.h5", "w") as f:
        for k, c in enumerate(columns):
            f[c] = data[:, k]
    evalbus("score", here / "map.yaml", here / "a.h5", "--out", here / "scored_h5")
    assert lines(here / "scored_h5")[0]["metrics"] == scored["metrics"]
    evalbus("score", here / "blind.yaml", table, "--out", here / "blind")
    blind = lines(here / "blind")[0]
    assert blind["failure_reason"] == "not_judged" and "success" not in blind["metrics"], blind
    assert json.loads((here / "blind" / "summary.json").read_text())["success_rate"] is None

    # Tests a folder with one file per episode. Episodes are in the order of the file names, and one is a failure.
    (here / "many").mkdir()
    for k in range(3):
        write(here / "many" / f"{k}.csv", data if k != 1 else data[:40])
    evalbus("score", here / "map.yaml", here / "many", "--out", here / "folder")
    episodes = lines(here / "folder")
    assert [e["episode"] for e in episodes] == [0, 1, 2] and [e["end_reason"] for e in episodes] == [
        "success", "end_of_data", "success"], episodes
    assert episodes[0]["metrics"] == episodes[2]["metrics"] == scored["metrics"]
    evalbus("report", here / "folder", "--out", here / "folder.html")
    assert "end_of_data" in (here / "folder.html").read_text() or "end of data" in (here / "folder.html").read_text()
    evalbus("export", here / "folder", "--csv", here / "folder.csv")
    assert (here / "folder.csv").read_text().count("\n") == 4

    # Expects one line that names the location of the error, exit code 1, and no half-written file.
    def bad_text(name, text):
        (here / name).write_text(text)
        return here / name

    def bad_map(name, what, by):
        text = map_text + poses
        assert what in text, what
        return bad_text(name, text.replace(what, by))

    def changed(name, change, names=columns):
        table = data.copy()
        result = change(table)
        return write(here / name, table if result is None else result, names)

    def set_to(row, column, value):
        def change(table):
            table[row, column] = value

        return change

    def tensors(name, actions, metadata=None, key="info_demo_action", cut=None):
        """Writes a safetensors file according to the specification of the format."""
        header = {key: {"dtype": "F64", "shape": actions.shape, "data_offsets": [0, actions.nbytes]}}
        if metadata:
            header["__metadata__"] = metadata
        text = json.dumps(header).encode()
        (here / name).write_bytes((struct.pack("<Q", len(text)) + text + actions.tobytes())[:cut])
        return here / name

    time = numpy.arange(len(data)) / 50.0
    time[9] = 0.01
    # No time unit explains a pause of 1e300 s.
    late = numpy.append(numpy.arange(len(data) - 1) / 50.0, 1e300)
    # The timestamps are in milliseconds but declared as seconds.
    sparse = numpy.arange(len(data)) * 20.0
    timed = (map_text + poses).replace("rate_hz: 50", "time: {column: t, unit: s}")
    bad_text("time.yaml", timed)
    numpy.savez_compressed(here / "packed.npz", q0=data[:, 0])
    numpy.savez(here / "objects.npz", **{c: numpy.array([{}], object) for c in columns})
    numpy.savez(here / "uneven.npz", **{c: data[: len(data) - (c == "q5"), k] for k, c in enumerate(columns)})
    (here / "cut.npz").write_bytes((here / "a.npz").read_bytes()[:5000])
    flipped = bytearray((here / "a.npz").read_bytes())
    flipped[len(flipped) // 2] ^= 1
    (here / "flipped.npz").write_bytes(flipped)
    (here / "cut.h5").write_bytes((here / "a.h5").read_bytes()[:3000])
    csv = (here / "a.csv").read_text()
    with h5py.File(here / "wide.h5", "w") as f:
        f["q"] = data[:, :13]
        for k, c in enumerate(columns[14:]):
            f[c] = data[:, 14 + k]
    wide = map_text + poses
    for k in range(14):
        wide = wide.replace(f": q{k},", f': "q[{k}]",').replace(f": q{k}}}", f': "q[{k}]"}}')
    bad_text("wide.yaml", wide)
    (here / "mixed").mkdir()
    (here / "mixed/0.csv").write_text(csv)
    (here / "mixed/1.csv").write_text(csv.replace("\n", "\n1,", 1))
    (here / "nothing").mkdir()
    good, out = here / "map.yaml", here / "never"
    score = [
        (good, changed("deg.csv", lambda t: numpy.hstack([numpy.degrees(t[:, :14]), t[:, 14:]])), "are these degrees"),
        (bad_map("as_deg.yaml", "unit: rad", "unit: inch"), table, "as_deg.yaml:4: key 'unit': expected deg or rad, got 'inch'"),
        (good, changed("nan.csv", set_to(7, 2, numpy.nan)), "nan.csv:9: column 'q2' is nan"),
        (good, changed("inf.csv", set_to(7, 16, numpy.inf)), "inf.csv:9: column 'x' is inf"),
        (good, changed("grip.csv", set_to(3, 14, 80)), "grip.csv:5: column 'gl': 80 is not between closed (0) and open"),
        (good, changed("quat.csv", set_to(3, 19, 3)), "quat.csv:5: the quaternion of 'pot' has norm"),
        (good, changed("less.csv", lambda t: t[:, :-1], columns[:-1]), "no column 'qz'"),
        (here / "time.yaml", changed("t.csv", lambda t: numpy.hstack([t, time[:, None]]), columns + ["t"]),
         "t.csv:11: column 't': the time changes from 0.16 to 0.01; it must increase"),
        (here / "time.yaml", changed("late.csv", lambda t: numpy.hstack([t, late[:, None]]), columns + ["t"]),
         "column 't': 1e+300 s after the previous sample, expected at most 60 s"),
        (here / "time.yaml", changed("ms.csv", lambda t: numpy.hstack([t, sparse[:, None]]), columns + ["t"]),
         "ms.csv: column 't': samples are usually 20 s apart, expected 0.0001 to 1 s (time: unit: s, ms, us or ns)"),
        (bad_map("rate.yaml", "rate_hz: 50", "rate_hz: 0.5"), table, "key 'rate_hz': expected a number in [1, 10000]"),
        (good, bad_text("quote.csv", csv.replace("\n", '\n"', 1)), "quote.csv:2: column 'q0': expected a number, got '\""),
        (good, here / "packed.npz", "is compressed"),
        (good, here / "objects.npz", "objects.npz"),
        (good, here / "uneven.npz", "uneven.npz: 'q"),
        (good, here / "cut.npz", "cut.npz: "),
        (good, here / "flipped.npz", "does not match its checksum (CRC-32)"),
        (good, here / "cut.h5", "cut.h5: not an HDF5 file, or truncated"),
        (here / "wide.yaml", here / "wide.h5", "expected 'q[0]' to 'q[12]'"),
        (good, bad_text("cut.csv", csv[: csv.rfind(",")]), "expected 23 values, one for each column, got 22"),
        (good, bad_text("text.csv", csv.replace("\n", "\nfast", 1)), "text.csv:2: column 'q0': expected a number, got 'fast"),
        (good, bad_text("names.csv", csv.split("\n")[0] + "\n"), "expected a line of names, then lines of numbers"),
        (good, bad_text("data.parquet", "PAR1"), "expected a file that ends in .csv"),
        (good, here / "none.csv", "none.csv: cannot be read: No such file"),
        (good, here / "nothing", "nothing: no *.csv"),
        (good, here / "mixed", "1.csv:2: expected 23 values"),
        (bad_map("joint.yaml", "left/joint1:", "left/joint9:"), table, "joint.yaml:5: key 'left/joint9': there is no joint 'left/joint9'; did you mean"),
        (bad_map("fewer.yaml", ", right/joint7: q13", ""), table, "joint 'right/joint7' is missing; all joints"),
        (bad_map("key.yaml", "grippers:", "gripper:"), table, "did you mean"),
        (bad_map("object.yaml", "  pot:", "  pan:"), table, "there is no object 'pan'"),
        (bad_map("task.yaml", "lift_pot/base", "lift_pan/base"), table, "lift_pan"),
        (here / "none.yaml", table, "none.yaml"),
    ]
    ok = numpy.hstack([numpy.tile([0, 0, 0, -1.5, 0, 1.5, -0.8], (60, 2)), numpy.zeros((60, 2))])
    nan, far = ok.copy(), ok.copy()
    nan[5, 3], far[6, 1] = numpy.nan, 45
    huge = here / "huge.safetensors"
    huge.write_bytes(struct.pack("<Q", 10**10) + b"{}")
    relative = json.dumps({"action_mode_absolute": False})
    demos = [
        (huge, "huge.safetensors: not a safetensors file: its header would be 10000000000 bytes long"),
        (tensors("short.safetensors", ok, cut=2000), "short.safetensors: "),
        (tensors("nan.safetensors", nan), "nan.safetensors: info_demo_action: step 5, column 3 is not a finite number"),
        (tensors("deg.safetensors", far), "step 6, column 1 is 45: outside the range of any joint in radians; are these degrees?"),
        (tensors("one_arm.safetensors", ok[:, :8].copy()), "expected [steps, 16], 7 + 7 joints and 2 grippers, got [60, 8]"),
        (tensors("other.safetensors", ok, key="action"), 'other.safetensors: no tensor "info_demo_action"'),
        (tensors("delta.safetensors", ok, {"environment_data": relative}), "changes of joint positions"),
        (here / "nothing", "nothing: no *.safetensors file in it"),
        (here / "none.safetensors", "none.safetensors: no such file or folder"),
    ]
    damaged = here / "damaged"
    shutil.copytree(run, damaged)
    log = damaged / "episodes/0000/events.lcmlog"
    blob = bytearray(log.read_bytes())
    next_event = blob.index(b"\xed\xa1\xda\x01", len(blob) // 2)
    blob[next_event - 100 : next_event + 100] = bytes(200)
    log.write_bytes(blob)
    doubled = here / "doubled"
    shutil.copytree(several, doubled)
    shutil.copy(several / "episodes/0000/events.lcmlog", doubled / "episodes/0001/events.lcmlog")
    exports = [
        (run, ["--hdf5", here / "set.hdf5"], "set.hdf5: exists; choose another name"),
        (run, ["--hdf5", out, "--camera", "hed"], "no camera 'hed'"),
        (run, ["--hdf5", out, "--camera", "head", "--size", "0x24"], "0x24"),
        (run, ["--safetensors", out, "--camera", "head"], "--camera requires --hdf5"),
        (run, ["--csv", out, "--successes"], "--successes requires --hdf5, --safetensors or --lerobot"),
        (run, ["--csv", out, "--camera", "head"], "--camera requires --hdf5, --lerobot or --mcap"),
        (run, ["--hdf5", out, "--size", "32x24"], "--size requires --camera"),
        (run, ["--csv", out, "--dataset", "a/b"], "--dataset requires --hf"),
        (run, ["--hdf5", here / "no/such/set.hdf5"], "no/such"),
        (damaged, ["--hdf5", out], "events.lcmlog: "),
        (damaged, ["--safetensors", out], "events.lcmlog: "),
        (doubled, ["--safetensors", out], "0001/events.lcmlog: its episode number also occurs in another log"),
        (here / "scored", ["--hdf5", out], "no action for tick 0: a training set requires an action for every tick"),
        (here / "blind", ["--hdf5", out, "--successes"], "no successful episode to export"),
        (here / "nothing", ["--hdf5", out], "nothing"),
    ]
    commands = [(["score", which, file, "--out", out], words) for which, file, words in score]
    for file, words in demos:
        commands += [(["demo", "info", file], words), (["demo", "convert", file, "--out", out], words)]
        commands += [(["run", "lift_pot", "--policy", f"demo:{file}", "--episodes", "1", "--in-process",
                       "--video", "none", "--out", out], words)]  # fmt: skip
    commands += [(["export", which, *options], words) for which, options, words in exports]
    before = sorted(here.rglob("*"))
    for command, words in commands:
        done = subprocess.run([BIN, *map(str, command)], capture_output=True, text=True, timeout=DEADLINE_S)
        said = done.stderr
        assert done.returncode == 1 and words in said and said.startswith("error: "), (command, done.returncode, said)
        assert said.count("\n") == 1 and len(said) < 600, (command, said)
        assert sorted(here.rglob("*")) == before, (command, set(here.rglob("*")) ^ set(before))
print("files in and out")
