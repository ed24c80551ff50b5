"""Files in and out with real programs: training sets read by h5py, trajectories written with NumPy, bad input."""
import json
import pathlib
import struct
import subprocess
import sys
import tempfile

try:
    import h5py
    import numpy
except ImportError:
    sys.exit(77)

BIN = pathlib.Path(sys.argv[1]) / "evalbus"


def evalbus(*arguments, code=0):
    done = subprocess.run([BIN, *map(str, arguments)], capture_output=True, text=True, timeout=300)
    assert done.returncode == code, (arguments, done.returncode, done.stdout, done.stderr)
    return done.stdout + done.stderr


def lines(run):
    return [json.loads(line) for line in (run / "episodes.jsonl").read_text().splitlines()]


with tempfile.TemporaryDirectory() as name:
    here = pathlib.Path(name)
    run = here / "run"
    evalbus("run", "lift_pot/base", "--policy", "expert", "--episodes", "1", "--in-process", "--video", "none", "--out", run)

    # robomimic's layout.
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

    # RoboEval's layout, and its converter's rule.
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
    assert json.loads(evalbus("demo", "info", demo, "--json"))["(no task's folder)"]["steps"] == steps
    assert "whole part" in evalbus("demo", "convert", demo, "--hz", "7", "--out", here / "x", code=1)

    # The run's own trajectory, from a table: what can be known agrees.
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
    assert "equal the recorded scores" in evalbus("rescore", here / "scored")
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

    # Whatever is wrong: one line that says where, and nothing half-written.
    degrees, nan, short = data.copy(), data.copy(), data[:, :-1]
    degrees[:, :14] = numpy.degrees(degrees[:, :14])
    nan[7, 2] = numpy.nan
    time = numpy.arange(len(data)) / 50.0
    time[9] = 0.01
    (here / "time.yaml").write_text((map_text + poses).replace("rate_hz: 50", "time: {column: t, unit: s}"))
    numpy.savez_compressed(here / "packed.npz", q0=data[:, 0])
    numpy.savez(here / "objects.npz", **{c: numpy.array([{}], object) for c in columns})
    (here / "cut.npz").write_bytes((here / "a.npz").read_bytes()[:5000])
    (here / "cut.h5").write_bytes((here / "a.h5").read_bytes()[:3000])
    cut = (here / "a.csv").read_text()
    (here / "cut.csv").write_text(cut[: cut.rfind(",")])
    (here / "unit.yaml").write_text((map_text + poses).replace("unit: rad", "unit: turns"))
    (here / "name.yaml").write_text((map_text + poses).replace("left/joint1:", "left/joint9:"))
    (here / "kind.yaml").write_text((map_text + poses).replace("grippers:", "gripper:"))
    bad = [
        ("map", write(here / "deg.csv", degrees), "degrees"),
        ("map", write(here / "nan.csv", nan), "nan.csv:9: column 'q2' is nan"),
        ("map", write(here / "less.csv", short, columns[:-1]), "no column 'qz'"),
        ("time", write(here / "t.csv", numpy.hstack([data, time[:, None]]), columns + ["t"]), "must go up"),
        ("map", here / "packed.npz", "is compressed"),
        ("map", here / "objects.npz", "objects.npz"),
        ("map", here / "cut.npz", "cut off"),
        ("map", here / "cut.h5", "cut.h5"),
        ("map", here / "cut.csv", "expected 23 values"),
        ("map", here / "none.csv", "cannot read"),
        ("unit", table, "expected deg or rad, got 'turns'"),
        ("name", table, "joint"),
        ("kind", table, "did you mean"),
    ]
    for which, file, words in bad:
        said = evalbus("score", here / f"{which}.yaml", file, "--out", here / "never", code=1)
        assert words in said and said.count("\n") == 1, (which, file, said)
        assert not (here / "never").exists(), (which, file)
    huge = here / "huge.safetensors"
    huge.write_bytes(struct.pack("<Q", 10**10) + b"{}")
    assert "10000000000 bytes" in evalbus("demo", "info", huge, code=1)
print("files in and out")
