"""Trains a small network on runs of the expert and serves it.

    evalbus run lift_pot --control-hz 20 --episodes 1 --out runs/expert
    python3 python/examples/pytorch_policy.py runs/expert
    evalbus run lift_pot --policy python/examples/pytorch_policy.yaml

Needs PyTorch: apt-get install python3-torch, or pip install torch. Training takes a few seconds.

Observation: "state", 16 numbers: the 14 joint positions of the two arms (rad, left arm first), then the openings of
the two grippers (1 open, 0 closed).
Actions: 20 steps of 16 numbers: 14 joint targets (rad), then the two grippers (0 open, 1 closed). About 10 of the
steps should be executed.
The observation does not contain the pot's pose, so the policy can only solve tasks without randomization.
"""

import sys

import evalbus
import numpy as np
import torch

STEPS = 20


def demonstrations(runs):
    """Returns (states (N, 16), chunks (N, STEPS, 16)) for the N ticks of all successful episodes of the runs."""
    states, chunks = [], []
    for folder in runs:
        run = evalbus.read_run(folder)
        for episode in run.episodes:
            if not episode.success:
                continue
            log = evalbus.read_log(run.logs[episode.index])
            state, action = log["EVALBUS_STATE"], log["EVALBUS_ACTION"]
            joints = state["arm"]["joint_position_rad"]
            seen = np.hstack([joints.reshape(len(joints), -1), state["gripper"]["opening"]])
            done = np.hstack([action["joint_position_rad"], action["gripper_closing"]])
            # The last state may have no action. Action chunks at the end are padded with the last action.
            ticks = np.arange(len(done))[:, None] + np.arange(STEPS)
            chunks.append(done[np.minimum(ticks, len(done) - 1)])
            states.append(seen[: len(done)])
    return np.concatenate(states), np.concatenate(chunks)


class Network(torch.nn.Module):
    def __init__(self, states, chunks):
        super().__init__()
        self.center, self.scale = states.mean(0), states.std(0) + 1e-2
        self.chunk_center, self.chunk_scale = chunks.mean(0), chunks.std(0) + 1e-2
        self.layers = torch.nn.Sequential(
            torch.nn.Linear(states.shape[1], 128),
            torch.nn.ReLU(),
            torch.nn.Linear(128, 128),
            torch.nn.ReLU(),
            torch.nn.Linear(128, chunks[0].numel()),
        )

    def forward(self, states):
        """Returns normalized action chunks, as used in the loss."""
        return self.layers((states - self.center) / self.scale).reshape(-1, *self.chunk_center.shape)

    def chunk(self, states):
        return self(states) * self.chunk_scale + self.chunk_center


def train(states, chunks, steps=1000, seed=0):
    # A network of this size trains fastest on one core.
    torch.set_num_threads(1)
    torch.manual_seed(seed)
    states, chunks = (torch.from_numpy(values).float() for values in (states, chunks))
    network = Network(states, chunks)
    wanted = (chunks - network.chunk_center) / network.chunk_scale
    optimizer = torch.optim.Adam(network.parameters(), lr=1e-3)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, 3e-3, total_steps=steps)
    for step in range(steps):
        rows = torch.randint(len(states), (64,))
        # Noise on the states teaches the network to return to the demonstrated trajectory.
        beside = states[rows] + 0.05 * network.scale * torch.randn(len(rows), states.shape[1])
        loss = (network(beside) - wanted[rows]).abs().mean()
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        schedule.step()
        if step % 200 == 0:
            print(f"step {step}  loss {loss.item():.3f}", flush=True)
    return network


class Policy:
    def __init__(self, network):
        self.network = network

    @torch.no_grad()
    def __call__(self, observation):
        state = torch.as_tensor(observation["state"], dtype=torch.float32)[None]
        return self.network.chunk(state)[0].numpy()


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit("usage: pytorch_policy.py RUN...")
    evalbus.serve(Policy(train(*demonstrations(sys.argv[1:]))))
