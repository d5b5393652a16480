"""ChoiceNet with random weights, and what it is asked about."""

from pathlib import Path

import numpy as np

from agents.choice.config import ChoiceConfig
from agents.choice.evaluator import ChoiceEvaluator
from agents.choice.network import shapes_of
from agents.choice.weights import ChoiceWeights, save_choice
from autopoly_env.arrays import AnyArray
from autopoly_env.simulator import Simulator
from tests.helpers.solving import simulator

SMALL = ChoiceConfig(side=4, width=12)


def tensors_of(config: ChoiceConfig = SMALL, seed: int = 0) -> dict[str, AnyArray]:
    """Random weights, none of them 0."""
    rng = np.random.default_rng(seed)
    return {name: rng.normal(0.0, 0.3, shape).astype(np.float32) for name, shape in shapes_of(config).items()}


def evaluator(config: ChoiceConfig = SMALL, seed: int = 0) -> ChoiceEvaluator:
    return ChoiceEvaluator(ChoiceWeights(config, tensors_of(config, seed)))


def saved_choice(folder: Path, config: ChoiceConfig = SMALL, seed: int = 0) -> str:
    """The file of random weights."""
    path = folder / f"choice_{seed}.safetensors"
    return str(save_choice(path, config, tensors_of(config, seed), {"why": "a test"}, {"final": 1.0}))


def quads_game(target: str = "L", **settings: object) -> Simulator:
    """A game in the modeller's style."""
    return simulator(target, **{"operators": "modeller", "faces": "quads", **settings})
