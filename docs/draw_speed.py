"""Draws where a step's microseconds go into docs/pictures/speed.svg, for docs/speed.md.

    python docs/draw_speed.py                         # measures this build, prints and draws
    PYTHONPATH=OTHER python docs/draw_speed.py --json other.json    # measures the build in the folder OTHER
    python docs/draw_speed.py --beside other.json     # draws both

Random legal play at 64 x 64 in one thread, in CPU time of that thread; what measuring itself takes is in it.
"""

import argparse
import json
import sys
import time
from collections import defaultdict
from collections.abc import Callable
from html import escape
from importlib import import_module
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from numba.core.dispatcher import Dispatcher

PICTURE = Path(__file__).parent / "pictures" / "speed.svg"
N_WARM, N_STEPS, N_ROUNDS = 300, 1500, 4
WIDTH, LEFT, BAR, GAP = 1000, 120, 46, 92  # pixels; GAP from one bar to the next
PARTS = {  # what is drawn: its colour; all but the first two is Python
    "refit kernel": "#2f7d4f",
    "other kernels": "#8cc09f",
    "operator, placement": "#f2b36b",
    "around refits": "#e08a4f",
    "legal mask": "#9db8e0",
    "observation": "#6f93cc",
    "score, defects": "#b9a3d6",
    "the rest": "#c9c9c9",
}
# Functions of Python by part: a module, a class in it or none, and a name there
TIMED = {
    "operator, placement": [
        ("autopoly_env.simulator", "", "tried"),
        ("autopoly_env.simulator", "", "Disagreement"),
        ("autopoly_env.env", "", "describe"),
    ],
    "around refits": [
        ("autopoly_env.simulator", "", "refit"),
        ("autopoly_env.simulator", "", "refit_best"),  # of builds that have it
        ("autopoly_env.simulator", "Simulator", "refit_target"),
    ],
    "legal mask": [("autopoly_env.operators", "ActionCodec", "legal_mask")],
    "observation": [("autopoly_env.observation", "Observer", "observe")],
    "score, defects": [("autopoly_env.simulator", "", "score"), ("autopoly_env.simulator", "", "defects_of")],
}


class Clock:
    """Microseconds of each part, less those of the parts called within it."""

    def __init__(self) -> None:
        self.spent: dict[str, float] = defaultdict(float)
        self._inner = [0.0]

    def timed(self, call: Callable[..., Any], part: str) -> Callable[..., Any]:
        def measured(*arguments: Any, **options: Any) -> Any:
            began = time.thread_time_ns()
            self._inner.append(0.0)
            try:
                return call(*arguments, **options)
            finally:
                whole = (time.thread_time_ns() - began) / 1000.0
                self.spent[part] += whole - self._inner.pop()
                self._inner[-1] += whole

        return measured

    def put_in(self) -> None:
        """Time every kernel and every function of TIMED from now on."""
        for module in [m for name, m in sys.modules.items() if name.startswith("autopoly_env") and m is not None]:
            for name, value in list(vars(module).items()):
                if isinstance(value, Dispatcher):
                    is_refit = module.__name__.endswith("refit_kernels") and name == "refit"
                    setattr(module, name, self.timed(value, "refit kernel" if is_refit else "other kernels"))
        for part, places in TIMED.items():
            for module_name, class_name, name in places:
                home = import_module(module_name)
                home = getattr(home, class_name) if class_name else home
                if hasattr(home, name):
                    setattr(home, name, self.timed(getattr(home, name), part))


def measure() -> dict[str, float]:
    """Microseconds of a step by part, in the quickest of a few rounds."""
    env = gymnasium.make("autopoly_env:AutoPoly-v0", resolution=64).unwrapped
    play(env, N_WARM, 1)
    clock = Clock()
    clock.put_in()
    step = clock.timed(env.step, "the rest")
    env.step = step  # type: ignore[method-assign]
    rounds = []
    for _ in range(N_ROUNDS):
        clock.spent.clear()
        play(env, N_STEPS, 2, clock)
        rounds.append({part: clock.spent[part] / N_STEPS for part in PARTS})
    return min(rounds, key=lambda parts: sum(parts.values()))


def play(env: Any, n_steps: int, seed: int, clock: Clock | None = None) -> None:
    """Random legal steps; those of resets do not count."""
    rng = np.random.default_rng(seed)
    _, info = env.reset(seed=seed)
    for _ in range(n_steps):
        _, _, terminated, truncated, info = env.step(int(rng.choice(np.flatnonzero(info["action_mask"]))))
        if terminated or truncated:
            kept = dict(clock.spent) if clock else {}
            _, info = env.reset()
            if clock:
                clock.spent.clear()
                clock.spent.update(kept)


def drawing(bars: dict[str, dict[str, float]]) -> str:
    """The bars one below the other, as an SVG; each part's microseconds stand in it where there is room."""
    most = max(sum(parts.values()) for parts in bars.values())
    scale, height = (WIDTH - LEFT - 130) / most, len(bars) * GAP + 64
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" '
        'font-family="DejaVu Sans, Helvetica, Arial, sans-serif" font-size="13">',
        f'<title>Where a step goes</title>\n<rect width="{WIDTH}" height="{height}" fill="#fff"/>',
    ]
    for k, (name, parts) in enumerate(bars.items()):
        x, y = float(LEFT), 20 + k * GAP
        python = sum(value for part, value in parts.items() if "kernel" not in part)
        lines.append(f'<text x="12" y="{y + 28}" font-weight="bold">{escape(name)}</text>')
        for part, value in parts.items():
            width = value * scale
            lines.append(
                f'<rect x="{x:.1f}" y="{y}" width="{width:.1f}" height="{BAR}" fill="{PARTS[part]}"><title>'
                f"{part}: {value:.0f} µs</title></rect>"
            )
            if width > 22:
                lines.append(f'<text x="{x + width / 2:.1f}" y="{y + 28}" text-anchor="middle">{value:.0f}</text>')
            x += width
        whole = sum(parts.values())
        lines.append(f'<text x="{x + 8:.1f}" y="{y + 20}" font-weight="bold">{whole:.0f} µs</text>')
        lines.append(f'<text x="{x + 8:.1f}" y="{y + 38}">Python {python / whole:.0%}</text>')
    x = 12.0
    for part, colour in PARTS.items():
        lines.append(f'<rect x="{x}" y="{height - 34}" width="12" height="12" fill="{colour}"/>')
        lines.append(f'<text x="{x + 17}" y="{height - 23}">{part}</text>')
        x += 34 + 7.4 * len(part)
    return "\n".join([*lines, "</svg>\n"])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the numbers there, and draw nothing")
    parser.add_argument("--beside", type=Path, metavar="FILE", help="numbers of another build, drawn above")
    given = parser.parse_args()
    found = measure()
    for part, value in found.items():
        print(f"{value:8.1f} µs  {part}")
    print(f"{sum(found.values()):8.1f} µs")
    if given.json is not None:
        given.json.write_text(json.dumps(found))
        return
    beside = {} if given.beside is None else {"before": json.loads(given.beside.read_text())}
    PICTURE.write_text(drawing({**beside, "now": found}), encoding="utf-8")


if __name__ == "__main__":
    main()
