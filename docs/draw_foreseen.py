"""Draws what ChoiceNet foresees into docs/pictures: `python docs/draw_foreseen.py [FOLDER]` (some seconds).

Of ten pictures in examples/, modelled in quads: the rectangle, and the shape two steps of the likeliest action later,
each with the three actions that the prior finds most promising: red, orange, yellow.
"""

import sys
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from agents.choice.evaluator import ChoiceEvaluator
from agents.choice.weights import load_choice
from agents.guided.measures import action_spots
from agents.guided.regions import action_points
from autopoly_env.arrays import ByteArray
from autopoly_env.export.sheet import save_png
from autopoly_env.score import ScoreWeights
from autopoly_env.silhouette import load_silhouette
from autopoly_env.simulator import Simulator, State
from autopoly_env.viewer import MARGIN, draw_mesh

ROOT = Path(__file__).parent.parent
NAMES = ("chair", "mug", "key", "table", "bottle", "hammer", "umbrella", "teapot", "floor_lamp", "wrench")
COLOURS = ("#d62728", "#ff7f0e", "#e7c500")
SIZE, N_SHOWN, N_STEPS = 230, 3, 2


def foreseen(evaluator: ChoiceEvaluator, simulator: Simulator, state: State) -> tuple[ByteArray, State]:
    """The state with its likeliest actions, and the state after the first of them that can be done."""
    actions = simulator.legal_actions(state)[1:]
    prior = evaluator.prior(simulator, state, actions)
    order = np.argsort(-prior, kind="stable")
    best = [actions[k] for k in order[:N_SHOWN]]
    words = [f"{a.operator.replace('_', ' ')} {prior[k]:.0%}" for a, k in zip(best, order, strict=False)]
    gain = float(evaluator.foresee(simulator, [state])[0]) - state.score.total
    caption = f"r_all {state.score.total:.0f}, {gain:+.0f} foreseen\n" + "\n".join(words)
    image = Image.fromarray(draw_mesh(state.mesh, simulator.silhouette, size=SIZE, caption=caption))
    pen = ImageDraw.Draw(image)
    spots = action_spots(state.mesh, best, action_points(state.mesh, best))
    for colour, spot in reversed(list(zip(COLOURS, spots, strict=False))):
        places = SIZE * (MARGIN + (1.0 - 2.0 * MARGIN) * spot)
        pen.line([(x, y) for x, y in places.tolist()], fill=colour, width=5)
    made = simulator.transition_all(state, [actions[k] for k in order])
    return np.asarray(image), made[0] if made else state


def main(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    evaluator, columns = ChoiceEvaluator(load_choice()), []
    for name in NAMES:
        target = load_silhouette(ROOT / "examples" / f"{name}.png")
        simulator = Simulator(target, operators="modeller", faces="quads", weights=ScoreWeights(w_sc=0.3))
        state, frames = simulator.initial(), []
        for step in range(N_STEPS + 1):
            frame, following = foreseen(evaluator, simulator, state)
            if step in (0, N_STEPS):
                frames.append(frame)
            state = following
        columns.append(np.vstack(frames))
    half = len(columns) // 2
    sheet = np.vstack([np.hstack(columns[:half]), np.hstack(columns[half:])])
    save_png(Image.fromarray(sheet), folder / "foreseen.png")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs" / "pictures")
