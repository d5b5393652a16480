"""Clone a teacher: teach the policy what `training.make_expert` has labelled, so that training begins with a good one.

    python -m training.make_expert runs/expert --n 4096                 # what every action leads to, in many states
    python -m training.make_expert runs/held_out --n 256 --held-out     # other targets, to measure with
    python -m training.rl_clone --config configs/train/clone.yaml       # runs/clone/policy.safetensors
    torchrun --nproc-per-node 8 -m training.rl_clone --config configs/train/clone.yaml   # one node, 8 processes

The likeliest actions are to be those that gain most: the target distribution is the softmax of what each action gains
in r_all, 0 for stopping, at the price of an element that is drawn for the sample. Where a shard has no outcomes (those
of `source=search`), all is on the action that was taken. The value is to be what the construction gained from there on.

The same command goes on with a run that was stopped.
"""

import json
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import torch
import typer
from torch import Tensor, nn
from torch.nn import functional
from torch.utils.data import Dataset

from agents.commands.running import GOES_ON, run_command
from agents.rl.config import NetConfig, Rules
from agents.rl.network import NEVER, MeshNet, observer_of
from agents.rl.player import observation_of
from agents.rl.weights import save_policy
from autopoly_env.errors import ConfigError, IllegalActionError
from autopoly_env.files import write_atomically
from autopoly_env.observation import PADDING, Observation
from autopoly_env.operators import OPERATORS, Action, ActionCodec
from training.networks.metrics import mean_rows
from training.networks.samples import Batch, HeldOut, LabelConfig, Sample, Stored, stored
from training.networks.trainer import OptimConfig, RunConfig, place_of, train
from training.networks.trajectories import Labelled, Trajectory
from training.options import plain, read_config
from training.policies.config import EnvConfig
from training.policies.exam import exams_of, mean_final, sit_all, told

_PICTURES = ("rendering", "target")
_HOPELESS = -1e3  # r_all points: gain of an action whose outcome is not known


@dataclass(frozen=True)
class CloneData:
    """Where samples come from, and how they are labelled."""

    shards: str = "runs/expert"
    held_out: str = "runs/held_out"
    n_held_out: int = 512  # samples to measure with, rounded up to whole batches of 64
    temperature: float = 0.5  # r_all points: of the softmax over what actions gain

    def __post_init__(self) -> None:
        if self.n_held_out < 1 or not self.temperature > 0.0:
            raise ConfigError(f"{self}: expected at least 1 held-out sample and a temperature above 0")


@dataclass(frozen=True)
class CloneConfig:
    """Everything that can be set."""

    net: NetConfig = field(default_factory=NetConfig)
    env: EnvConfig = field(default_factory=EnvConfig)  # its rules, and the prices of its courses
    data: CloneData = field(default_factory=CloneData)
    value_weight: float = 0.5  # of the value's squared error beside the cross entropy
    optim: OptimConfig = field(default_factory=OptimConfig)
    run: RunConfig = field(default_factory=RunConfig)
    n_exam: int = 48  # unseen targets of each course that the result is examined on

    def __post_init__(self) -> None:
        if self.n_exam < 1 or not self.value_weight >= 0.0:
            raise ConfigError(
                f"n_exam {self.n_exam}, value_weight {self.value_weight}: expected at least 1 and at least 0"
            )

    def prices(self) -> tuple[float, ...]:
        """Of an element, as the courses have them."""
        return tuple(sorted({course.w_sc for course in self.env.courses}))


# --- one sample ---


@dataclass(frozen=True)
class Prepared:
    """A labelled state as the policy sees it, but for the price."""

    seen: Observation
    mask: np.ndarray  # (G,) bool
    index: np.ndarray  # (A,) number of each action; -1 where there is no room for it
    mirrored: np.ndarray  # (G,) the number of each action in the mirror image of the mesh
    state: Labelled
    totals: np.ndarray  # (S - k, 3) score of this state and of all later ones of the construction


class Pool(Dataset[Sample]):
    """Endless samples by number; number i depends on (seed, i) alone."""

    def __init__(self, trajectories: Stored, config: CloneConfig, seed: int, turn: bool = True) -> None:
        self._trajectories, self._config, self._seed, self._turn = trajectories, config, seed, turn
        self._rules = config.env.rules()
        self._prepared: dict[int, list[Prepared]] = {}  # by number of the construction: unpacking takes longer

    def __getitem__(self, i: int) -> Sample:
        rng = np.random.default_rng((self._seed, i))
        states: list[Prepared] = []
        while not states:
            states = self._states(int(rng.integers(len(self._trajectories))))
        one = states[int(rng.integers(len(states)))]
        prices = self._config.prices()
        w_sc = prices[int(rng.integers(len(prices)))]
        return sample_of(one, w_sc, int(rng.integers(8)) if self._turn else 0, self._config)

    def _states(self, number: int) -> list[Prepared]:
        if number not in self._prepared:
            self._prepared[number] = prepared(self._trajectories[number], self._rules)
        return self._prepared[number]


def prepared(trajectory: Trajectory, rules: Rules) -> list[Prepared]:
    """The states of a construction in which something may be done and that the padding has room for."""
    observer, codec = observer_of(rules), ActionCodec(rules.operators, rules.max_vertices)
    picture = observer.picture_of(trajectory.silhouette)
    found = []
    for k, state in enumerate(trajectory.states):
        try:
            observer.check_fits(state.mesh)
        except ConfigError:
            continue
        if state.actions and k < rules.max_steps:
            scores = np.stack([later.score for later in trajectory.states[k:]])
            seen = observer.observe(state.mesh, picture, rules.max_steps - k)
            mask, index = codec.legal_mask(state.mesh), _numbers(codec, state)
            found.append(Prepared(seen, mask, index, _mirrored(codec, seen), state, scores))
    return found


def _numbers(codec: ActionCodec, state: Labelled) -> np.ndarray:
    """(A,) the codec's number of each action, -1 where it has none."""
    numbers = []
    for action in state.actions:
        try:
            numbers.append(codec.encode(action))
        except IllegalActionError:
            numbers.append(-1)
    return np.array(numbers)


def _mirrored(codec: ActionCodec, seen: Observation) -> np.ndarray:
    """(G,) where each action goes when every face is wound the other way: corners change places, others stay."""
    order = np.arange(codec.n_actions)
    swap = _reversed_corners(seen["faces"])
    for name in codec.operators:
        if OPERATORS[name].element == "corner":
            start = codec.encode(Action(name, 0))
            order[start : start + len(swap)] = start + swap
    return order


def _reversed_corners(faces: np.ndarray) -> np.ndarray:
    """(H,) the number of each corner when each face's corners stand in the other order."""
    owners = faces.reshape(-1, 2)[:, 0]
    owners = owners[owners != PADDING]
    begins = np.flatnonzero(np.diff(owners, prepend=-1))
    sizes = np.diff(np.append(begins, len(owners)))
    first, size = np.repeat(begins, sizes), np.repeat(sizes, sizes)
    return 2 * first + size - 1 - np.arange(len(owners))


def sample_of(one: Prepared, w_sc: float, way: int, config: CloneConfig) -> Sample:
    """What the policy sees, mirrored (bit 0: x, bit 1: y) and transposed (bit 2), and what it is to say."""
    labels = LabelConfig(temperature=config.data.temperature, w_sc=w_sc)
    policy, gains = np.zeros(len(one.mask)), np.full(len(one.mask), _HOPELESS)
    odds, known = labels.policy(one.state), one.index >= 0
    policy[0], gains[0] = odds[0], 0.0
    policy[one.index[known]] = odds[1:][known]
    gains[one.index[known]] = np.maximum(labels.gains(one.state)[known], _HOPELESS)
    policy *= one.mask
    totals = one.totals @ np.array((labels.w_sm, -labels.w_sc, -labels.w_si))
    value = config.env.reward_scale * (totals.max() - totals[0])
    sample = {
        **observation_of(turned(one.seen, way), one.mask, w_sc),
        "policy": (policy / max(policy.sum(), 1e-9)).astype(np.float32),
        "gains": gains.astype(np.float32),
        "value": np.array((value,), np.float32),
    }
    if way.bit_count() % 2:
        for name in ("action_mask", "policy", "gains"):
            moved = np.empty_like(sample[name])
            moved[one.mirrored] = sample[name]
            sample[name] = moved
    return sample


def turned(seen: Observation, way: int) -> Observation:
    """The observation mirrored and transposed as `way` says; where that flips areas, faces are wound the other way."""
    mirror_x, mirror_y, transpose = way & 1, way & 2, way & 4
    made = dict(seen)
    for name in _PICTURES:
        picture = seen[name][:, :, ::-1] if mirror_x else seen[name]
        picture = picture[:, ::-1] if mirror_y else picture
        made[name] = np.ascontiguousarray(np.swapaxes(picture, 1, 2) if transpose else picture)
    n = 2 * int(seen["counts"][0])
    points = seen["vertices"][:n].reshape(-1, 2).copy()
    points[:, 0] = 1.0 - points[:, 0] if mirror_x else points[:, 0]
    points[:, 1] = 1.0 - points[:, 1] if mirror_y else points[:, 1]
    made["vertices"] = seen["vertices"].copy()
    made["vertices"][:n] = (points[:, ::-1] if transpose else points).ravel()
    if way.bit_count() % 2:
        corners = seen["faces"].reshape(-1, 2).copy()
        swap = _reversed_corners(seen["faces"])
        corners[swap] = seen["faces"].reshape(-1, 2)[: len(swap)]
        made["faces"] = corners.ravel()
    return made


# --- the loss ---


class CloneLosses(nn.Module):
    """A batch to the terms of its loss."""

    def __init__(self, net: MeshNet, value_weight: float) -> None:
        super().__init__()
        self.net, self.value_weight = net, value_weight

    def forward(self, batch: Batch) -> dict[str, Tensor]:
        """The terms; "loss" is their weighted sum. "choice" is the divergence of the policy from its target."""
        logits, value = self.net(batch)
        return self.terms(logits, value, batch)

    def terms(self, logits: Tensor, value: Tensor, batch: Batch) -> dict[str, Tensor]:
        """The terms of what the network has said."""
        target = batch["policy"]
        log_choice = logits.log_softmax(-1).masked_fill(logits <= 0.5 * NEVER, 0.0)
        choice = (torch.xlogy(target, target) - target * log_choice).sum(-1).mean()
        worth = functional.mse_loss(value, batch["value"][:, 0])
        return {"loss": choice + self.value_weight * worth, "choice": choice, "value": worth}


class CloneTask:
    """The policy for the trainer."""

    name = "clone"

    def __init__(self, config: CloneConfig) -> None:
        torch.manual_seed(config.run.seed)
        self.config = config
        self.net = MeshNet(config.net, config.env.rules())
        self.losses = CloneLosses(self.net, config.value_weight)
        self.stream = Pool(stored(config.data.shards), config, config.run.seed)
        unseen = Pool(stored(config.data.held_out, held_out=True), config, config.run.seed, turn=False)
        self._held_out = HeldOut(unseen, config.data.n_held_out)

    def measure(self, device: torch.device) -> dict[str, float]:
        """Loss, its terms, and what share of the best gain the likeliest action holds, on the held-out samples."""
        rows = []
        for batch in self._held_out.batches(device):
            logits, value = self.net(batch)
            terms = {name: float(term) for name, term in self.losses.terms(logits, value, batch).items()}
            best = batch["gains"].amax(-1)
            won = batch["gains"].gather(1, logits.argmax(-1, keepdim=True))[:, 0].clamp(min=-10.0)
            rows.append({**terms, "gain_share": float(won.sum() / best.sum().clamp(min=1e-6))})
        return mean_rows(rows)

    def draw(self, _device: torch.device) -> Any:
        """Renderings above their targets."""
        batch = self._held_out.first(8, torch.device("cpu"))
        return np.concatenate([np.concatenate(list(batch[name][:, 0].numpy()), axis=1) for name in _PICTURES], axis=0)


def finish_clone(task: CloneTask, folder: Path) -> Path:
    """Measure and examine the network that `train` left; write report.json and policy.safetensors."""
    config, net = task.config, task.net.cpu().eval()
    with torch.no_grad():
        metrics = task.measure(torch.device("cpu"))
    marks = sit_all(exams_of(config.env, config.n_exam, 128), net)
    for course, one in marks.items():
        metrics |= {f"{course}_{name}": value for name, value in vars(one).items()}
    metrics["final"] = mean_final(marks)
    write_atomically(
        folder / "report.json", json.dumps({"metrics": metrics, "settings": plain(config)}, indent=2) + "\n"
    )
    path = save_policy(folder / "policy.safetensors", net, "clone", plain(config), metrics)
    print(f"{path}: {told(marks)}; gain_share {metrics['gain_share']:.3f}")
    return path


HELP = """Teach the policy what training.make_expert has labelled.

\b
Examples:
  python -m training.rl_clone --config configs/train/clone.yaml
  python -m training.rl_clone --config configs/train/clone.yaml optim.n_steps=1000 --out runs/short

The same command goes on with a run that was stopped. At the end the folder has policy.safetensors, to begin
training.train_rl with. See docs/rl.md.
"""

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)


@app.command(help=HELP)
def main_command(
    overrides: Annotated[list[str] | None, typer.Argument(metavar="SECTION.KEY=VALUE")] = None,
    config: Annotated[Path | None, typer.Option(help="A YAML file; what it leaves out is at its default.")] = None,
    out: Annotated[Path, typer.Option(help="The run's folder.")] = Path("runs/clone"),
) -> int:
    settings = read_config(config, overrides or [], CloneConfig())
    with place_of(settings.run) as place:
        task = CloneTask(settings)
        train(task, settings.optim, settings.run, plain(settings), out, place)
        if place.leads:
            finish_clone(task, out)
    return 0


def main(arguments: list[str] | None = None) -> int:
    """Run the command; returns the exit code."""
    return run_command(app, arguments, "python -m training.rl_clone", stopped=GOES_ON)


if __name__ == "__main__":
    sys.exit(main())
