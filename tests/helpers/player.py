"""What tests of the player share: a page to be read as a text, or opened in a browser and asked what it shows."""

import json
from collections.abc import Callable
from dataclasses import replace

from autopoly_env.silhouette import Silhouette
from tests.helpers.browser import Page
from tests.helpers.constructions import STEPS, house
from tests.helpers.drawings import HOUSE, painted

LAST = len(STEPS)
HOSTILE = (
    """</script><script>hacked = 1</script>"'`${hacked = 1}\n{{data}}<img src=x onerror="hacked = 1">\u2028<!--&lt;"""
)


def wanted(name: str = "house") -> Silhouette:
    return replace(painted(HOUSE), name=name)


Open = Callable[..., Page]


def text(page: Page, selector: str) -> str:
    return str(page.evaluate(f"document.querySelector({json.dumps(selector)}).textContent"))


def step_of(page: Page) -> int:
    """The step that slider, list, text and mesh agree on."""
    shown = page.evaluate(
        """[document.getElementById("step").valueAsNumber,
            [...document.querySelectorAll("#steps button")].findIndex(item => item.ariaCurrent === "step"),
            Number(document.getElementById("count").textContent.split(" / ")[0]),
            Number(/Step (\\d+) of/.exec(document.getElementById("which").textContent)?.[1] || 0)]"""
    )
    (step,) = set(shown)
    n_vertices = house(step).final().counts[0]
    assert page.evaluate("document.querySelectorAll('#vertices > g').length") == n_vertices
    return int(step)


def names(page: Page, selector: str) -> set[str]:
    """The names of mesh elements, as a reader hears them."""
    script = """[...document.querySelectorAll(SELECTOR)].map(element => {
      element.dispatchEvent(new PointerEvent("pointerover", {bubbles: true}));
      return document.getElementById("tag").textContent;
    })""".replace("SELECTOR", json.dumps(selector))
    return set(page.evaluate(script))
