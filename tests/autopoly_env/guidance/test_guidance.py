"""Guidance as a whole: what is refused, and what settings say of it."""

from typing import Any

import numpy as np
import pytest

from autopoly_env.errors import ConfigError, IllegalActionError
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import Action
from autopoly_env.simulator import Simulator, State
from tests.helpers.drawings import HOUSE, painted
from tests.helpers.guidance import START
from tests.helpers.shapes import polygon

FLIPPED = PolyMesh.from_faces([(0.2, 0.2), (0.2, 0.8), (0.8, 0.8), (0.8, 0.2)], [(0, 1, 2, 3)])
CROSSED = polygon([(0.1, 0.1), (0.9, 0.1), (0.1, 0.6), (0.9, 0.9)])
LOPSIDED = polygon([(0.1, 0.1), (0.9, 0.2), (0.8, 0.8), (0.2, 0.9)])


@pytest.mark.parametrize(
    ("guidance", "complaint"),
    [
        ({"locked": (0,)}, "no start mesh"),
        ({"start": START, "locked": (0, 7)}, "locked vertex 7 is not in the start mesh"),
        ({"start": START, "locked": (0,), "symmetry": 0.5}, "its mirror image 1 is not"),
        ({"start": LOPSIDED, "symmetry": 0.5}, "not symmetric about x = 0.5: mirror it"),
        ({"start": LOPSIDED, "symmetry": True}, "not symmetric about any upright line: leave symmetry out"),
        ({"start": START, "symmetry": 0.25}, "not symmetric about x = 0.25: it is about x = 0.5; give that axis"),
        ({"start": CROSSED}, "cross"),
        ({"start": FLIPPED}, "flipped"),
        ({"start": START.with_vertices(START.vertices + 0.5)}, "outside the unit square"),
        ({"start": START.with_vertices(START.vertices * np.nan)}, "not finite"),
        ({"start": "mug.obj"}, "expected a PolyMesh or a ConstructionSequence"),
        ({"start": START, "operators": "weld"}, "weld"),
        ({"symmetry": 0.0}, "well inside"),
        ({"symmetry": 1.2}, "well inside"),
        ({"symmetry": float("nan")}, "expected a number"),
        ({"importance": np.zeros((4, 4))}, "black all over"),
        ({"importance": np.full((4, 4), np.nan)}, "NaN"),
        ({"importance": np.full((4, 4), -0.5)}, "spans -0.5"),
        ({"importance": np.full((4, 4), 300.0)}, "spans 300"),
        ({"importance": np.eye(4)[:3]}, "4x3 pixels"),
        ({"importance": np.pad(np.ones((4, 1)), ((0, 0), (0, 31)))[:, :4]}, "black on all of the object"),
        ({"importance": __file__}, "not an image"),
        ({"importance": "nothere.png"}, "does not exist"),
    ],
)
def test_impossible_guidance__is_one_clear_error(guidance: dict[str, Any], complaint: str) -> None:
    with pytest.raises(ConfigError, match=complaint) as caught:
        Simulator(painted(HOUSE), resolution=32, **guidance)
    assert "\n" not in str(caught.value)


def test_initial__of_another_mesh_has_to_be_symmetric() -> None:
    game = Simulator(painted(HOUSE), resolution=32, symmetry=True)
    with pytest.raises(ConfigError, match="not symmetric"):
        game.initial(LOPSIDED)
    with pytest.raises(IllegalActionError, match="not symmetric"):
        game.transition(State(LOPSIDED, game.score(LOPSIDED)), Action("edge_subdivide", 0))


def test_unguided_settings__are_those_without_guidance() -> None:
    said = Simulator(painted(HOUSE)).settings()
    assert not {"importance", "start", "earlier_steps", "locked", "symmetry"} & said.keys()
