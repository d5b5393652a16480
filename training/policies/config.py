"""Settings of `training.train_rl`, and how a run notes and compares them."""

import math
from dataclasses import dataclass, field, replace
from typing import Any, Literal

from agents.rl.config import NetConfig, SpaceSpec, TaskSpec
from autopoly_env.arguments import above, at_least, share
from autopoly_env.errors import ConfigError
from autopoly_env.mesh import FACE_RULES
from autopoly_env.operators import preset
from autopoly_env.shown import short

HARMLESS = (  # a run may go on with other ones
    "total_steps",
    "minutes",
    "envs",
    "device",
    "n_threads",
    "eval_every",
    "save_every",
    "n_plays",
)


@dataclass(frozen=True)
class EnvConfig:
    """The environments."""

    courses: tuple[TaskSpec, ...] = (TaskSpec(), TaskSpec("objects", 0.3))  # the tasks; environments take them in turn
    operators: str = "full"  # that the policy has, beside those of its courses
    resolution: int = 64  # pixels a side at which meshes are fitted and scored while learning
    obs_resolution: int = 64  # pixels a side of the observed pictures
    max_steps: int = 24
    max_vertices: int = 48
    reward_scale: float = 0.1  # reward of a point of r_all
    illegal_penalty: float = 1.0  # points of r_all
    n_plays: int = 4  # episodes with a target before the next one comes, which takes longer than a step

    def __post_init__(self) -> None:
        at_least(1, n_plays=self.n_plays)
        if not self.courses:
            raise ConfigError("courses: expected at least one task")
        above(0, reward_scale=self.reward_scale)
        at_least(0, illegal_penalty=self.illegal_penalty)
        self.spec()

    def spec(self) -> SpaceSpec:
        """The spaces that the policy is made for: the operators of all courses, each once; their rules and prices."""
        lists = [self.operators, *(task.policy_operators for task in self.courses if task.policy_operators)]
        operators = dict.fromkeys(operator.name for names in lists for operator in preset(names))
        faces = tuple(rule for rule in FACE_RULES if rule in {task.faces for task in self.courses})
        prices = [price for task in self.courses for price in task.prices]
        spaces = (self.max_vertices, self.obs_resolution, self.max_steps)
        return SpaceSpec(tuple(operators), *spaces, faces, (min(prices), max(prices)))

    def tasks(self) -> tuple[TaskSpec, ...]:
        """The courses, with the operators of each."""
        return tuple(replace(task, policy_operators=task.policy_operators or self.operators) for task in self.courses)


@dataclass(frozen=True)
class LearningRateConfig:
    """The learning rate: a linear warm-up, then a straight line down to `last`."""

    lr: float = 5e-4
    last: float = 0.1  # share of lr at the end
    warmup: float = 0.02  # share of the training

    def __post_init__(self) -> None:
        above(0, lr=self.lr)
        share(last=self.last)
        if not 0.0 <= self.warmup < 1.0:
            raise ConfigError(f"warmup={short(self.warmup)}: expected a share from 0, below 1")

    def lr_at(self, done: float) -> float:
        """The learning rate when this share of the training, 0 to 1, is done."""
        if done < self.warmup:
            return self.lr * max(done / self.warmup, 0.02)
        return self.lr * (1.0 + (self.last - 1.0) * (done - self.warmup) / (1.0 - self.warmup))


@dataclass(frozen=True)
class PpoOptions:
    """SB3's own arguments of PPO and MaskablePPO."""

    n_steps: int = 64  # of each environment between updates
    batch_size: int = 512
    n_epochs: int = 3
    gamma: float = 1.0  # rewards add up to what the shape gained: nothing is to be hurried
    gae_lambda: float = 0.95
    clip_range: float = 0.2
    ent_coef: float = 0.01
    vf_coef: float = 0.5
    max_grad_norm: float = 0.5
    target_kl: float | None = None

    def __post_init__(self) -> None:
        _check(self, n_steps=2, batch_size=2, n_epochs=1)


@dataclass(frozen=True)
class A2cOptions:
    """SB3's own arguments of A2C."""

    n_steps: int = 8
    gamma: float = 1.0
    gae_lambda: float = 0.95
    ent_coef: float = 0.01
    vf_coef: float = 0.5
    max_grad_norm: float = 0.5

    def __post_init__(self) -> None:
        _check(self, n_steps=1)


@dataclass(frozen=True)
class DqnOptions:
    """SB3's own arguments of DQN."""

    buffer_size: int = 50_000  # transitions, 25 kB each
    learning_starts: int = 2_000  # steps of random play
    batch_size: int = 128
    gamma: float = 1.0
    train_freq: int = 4  # steps of each environment between updates
    gradient_steps: int = 8
    target_update_interval: int = 2_000
    exploration_fraction: float = 0.3
    exploration_final_eps: float = 0.05
    max_grad_norm: float = 5.0

    def __post_init__(self) -> None:
        _check(self, buffer_size=1, batch_size=1, train_freq=1, gradient_steps=1, target_update_interval=1)


@dataclass(frozen=True)
class CurriculumConfig:
    """Easy constructions first: the greatest difficulty grows from 1 to that of the task."""

    enabled: bool = False
    until: float = 0.5  # share of the training after which it is that of the task

    def __post_init__(self) -> None:
        if not 0.0 < self.until <= 1.0:
            raise ConfigError(f"until={short(self.until)}: expected a share of the training, above 0 and at most 1")


@dataclass(frozen=True)
class RlRunConfig:
    """How a run is carried out."""

    seed: int = 0
    total_steps: int = 1_000_000  # of all environments together
    minutes: float = 0.0  # after which it ends, whichever comes first; 0: no limit
    n_envs: int = 32
    envs: Literal["native", "subproc"] = "native"  # all in one process, or one process each
    device: Literal["auto", "cpu", "cuda"] = "auto"
    n_threads: int = 0  # of torch; 0: as it likes
    init: str = ""  # weights to begin with: a .safetensors file, or a .zip of SB3
    eval_every: int = 50_000  # steps
    n_eval: int = 48  # targets of each task
    eval_resolution: int = 128  # pixels a side
    save_every: int = 20_000  # steps

    def __post_init__(self) -> None:
        at_least(1, total_steps=self.total_steps, n_envs=self.n_envs, n_eval=self.n_eval)
        at_least(1, eval_every=self.eval_every, save_every=self.save_every)
        at_least(0, seed=self.seed, n_threads=self.n_threads, minutes=self.minutes)


@dataclass(frozen=True)
class TrainRlConfig:
    """Everything that can be set."""

    algorithm: Literal["maskable_ppo", "ppo", "a2c", "dqn"] = "maskable_ppo"
    net: NetConfig = field(default_factory=NetConfig)
    env: EnvConfig = field(default_factory=EnvConfig)
    optim: LearningRateConfig = field(default_factory=LearningRateConfig)
    ppo: PpoOptions = field(default_factory=PpoOptions)
    a2c: A2cOptions = field(default_factory=A2cOptions)
    dqn: DqnOptions = field(default_factory=DqnOptions)
    curriculum: CurriculumConfig = field(default_factory=CurriculumConfig)
    run: RlRunConfig = field(default_factory=RlRunConfig)

    def options(self) -> PpoOptions | A2cOptions | DqnOptions:
        """The arguments of the algorithm."""
        if self.algorithm == "a2c":
            return self.a2c
        return self.dqn if self.algorithm == "dqn" else self.ppo

    @property
    def rollout(self) -> int:
        """Steps of all environments together from update to update; a training plays whole rollouts."""
        options = self.options()
        return self.run.n_envs * (options.train_freq if isinstance(options, DqnOptions) else options.n_steps)

    def last_step(self, done: int) -> int:
        """The step that a training which stands at `done` ends with: `total_steps`, up to a whole rollout."""
        return done + math.ceil(max(0, self.run.total_steps - done) / self.rollout) * self.rollout


def _check(options: Any, **least: int) -> None:
    """Raise ConfigError for what is out of range in the arguments of an algorithm."""
    for name, bound in {**least, "max_grad_norm": 0, "ent_coef": 0, "vf_coef": 0}.items():
        at_least(bound, **{name: getattr(options, name, bound)})
    if not 0.0 <= options.gamma <= 1.0:
        raise ConfigError(f"gamma={short(options.gamma)}: expected a discount, 0 to 1")
