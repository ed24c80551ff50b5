"""Behavior cloning: trains a small network on a training set of evalbus, and serves it. See docs/tutorial_training.md.

    python3 python/examples/behavior_cloning.py train demos.hdf5 --steps 100,3000 --out policy
    python3 python/examples/behavior_cloning.py serve policy/3000.pt

Needs PyTorch and h5py: apt-get install python3-torch python3-h5py, or pip install torch h5py.

Observation: "state", 19 numbers: the 14 joint positions of the two arms (rad, left arm first), the openings of the two
grippers (1 open, 0 closed), the position of the pot in the world frame (m).
Actions: 10 steps of 16 numbers: 14 joint targets (rad), then the two grippers (0 open, 1 closed).
"""

import argparse
import pathlib

import numpy as np
import torch

CHUNK, WIDTH = 10, 128


def demonstrations(file):
    """Returns (states (N, 19), chunks (N, CHUNK, 16)) for the N steps of all successful episodes of a training set."""
    import h5py

    states, chunks = [], []
    with h5py.File(file) as data:
        for name in data["mask/success"][:]:
            demo = data["data"][name.decode()]
            obs, actions = demo["obs"], demo["actions_raw"][:]
            states.append(np.hstack([obs["joint_position"], obs["gripper_opening"], obs["pot_pose"][:, :3]]))
            # Action chunks at the end of an episode are padded with its last action.
            ahead = np.arange(len(actions))[:, None] + np.arange(CHUNK)
            chunks.append(actions[np.minimum(ahead, len(actions) - 1)])
    return np.concatenate(states), np.concatenate(chunks)


class Network(torch.nn.Module):
    def __init__(self):
        super().__init__()
        # Mean and standard deviation of the training data are saved with the weights.
        for name, shape in {"state": (19,), "chunk": (CHUNK, 16)}.items():
            self.register_buffer(f"{name}_mean", torch.zeros(shape))
            self.register_buffer(f"{name}_spread", torch.ones(shape))
        self.layers = torch.nn.Sequential(
            torch.nn.Linear(19, WIDTH),
            torch.nn.ReLU(),
            torch.nn.Linear(WIDTH, WIDTH),
            torch.nn.ReLU(),
            torch.nn.Linear(WIDTH, CHUNK * 16),
        )

    def forward(self, states):
        """Returns normalized action chunks, as used in the loss."""
        return self.layers((states - self.state_mean) / self.state_spread).reshape(-1, CHUNK, 16)

    def chunk(self, states):
        return self(states) * self.chunk_spread + self.chunk_mean


def train(file, checkpoints, out, seed=0):
    """Trains and writes a checkpoint OUT/STEPS.pt after each number of steps in `checkpoints`."""
    # A network of this size trains fastest on one core.
    torch.set_num_threads(1)
    torch.manual_seed(seed)
    states, chunks = (torch.from_numpy(values).float() for values in demonstrations(file))
    print(f"training on {len(states)} steps", flush=True)
    network = Network()
    network.state_mean, network.state_spread = states.mean(0), states.std(0) + 1e-2
    network.chunk_mean, network.chunk_spread = chunks.mean(0), chunks.std(0) + 1e-2
    wanted = (chunks - network.chunk_mean) / network.chunk_spread
    out.mkdir(parents=True, exist_ok=True)
    optimizer = torch.optim.Adam(network.parameters())
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, 2e-3, total_steps=max(checkpoints))
    for step in range(1, max(checkpoints) + 1):
        rows = torch.randint(len(states), (64,))
        loss = (network(states[rows]) - wanted[rows]).abs().mean()
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        schedule.step()
        if step % 1000 == 0 or step in checkpoints:
            print(f"step {step}  loss {loss.item():.3f}", flush=True)
        if step in checkpoints:
            torch.save(network.state_dict(), out / f"{step}.pt")


class Policy:
    def __init__(self, checkpoint):
        self.network = Network()
        self.network.load_state_dict(torch.load(checkpoint))
        torch.set_num_threads(1)

    @torch.no_grad()
    def __call__(self, observation):
        state = torch.as_tensor(observation["state"], dtype=torch.float32)[None]
        return self.network.chunk(state)[0].numpy()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    what = parser.add_subparsers(dest="what", required=True)
    learn = what.add_parser("train")
    learn.add_argument("hdf5", help="training set written by evalbus export --hdf5")
    learn.add_argument("--steps", default="3000", help="numbers of steps after which a checkpoint is written, separated by commas")
    learn.add_argument("--out", type=pathlib.Path, required=True, help="folder of the checkpoints")
    serve = what.add_parser("serve")
    serve.add_argument("checkpoint")
    serve.add_argument("--port", type=int, default=8000)
    options = parser.parse_args()
    if options.what == "train":
        train(options.hdf5, [int(steps) for steps in options.steps.split(",")], options.out)
    else:
        import evalbus

        evalbus.serve(Policy(options.checkpoint), port=options.port)


if __name__ == "__main__":
    main()
