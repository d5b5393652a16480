"""Records of runs: their lines, and lines that older releases have written."""

import json
from typing import Any

import pytest

from autopoly_env.mesh import PolyMesh
from training.records import MeshData, Outcome, Record

MESH = MeshData.of(PolyMesh.rectangle(0.25, 0.25, 0.75, 0.75))
LESSON: dict[str, Any] = {
    **{"valid": 1.0, "blocking_in": 0.75, "moved": 0.5},
    **{"quads": 1.0, "ngons": 0, "concave": 0, "effort": 7.03, "returns": 2},
}
OUTCOME = Outcome(0.9, 9, 0, 81.0, 4, 4, 1, 0, 1, 10, 0.5, "finished", [(1, 0.1, 50.0)], MESH, **LESSON)
RECORD = Record("climb", "chair", 0, OUTCOME)


def test_record__comes_back_from_its_line() -> None:
    assert Record.from_json(RECORD.to_json()) == RECORD
    failed = Record("climb", "chair", 0, None, "out of memory")
    assert Record.from_json(failed.to_json()) == failed


@pytest.mark.parametrize("n_known", [0, 3, 7])
def test_record__of_an_older_release_lacks_what_was_not_measured_then(n_known: int) -> None:
    line = json.loads(RECORD.to_json())
    unknown = list(LESSON)[n_known:]
    for name in unknown:
        del line[name]
    outcome = Record.from_json(json.dumps(line)).outcome
    assert outcome is not None
    assert {name: getattr(outcome, name) for name in LESSON} == LESSON | dict.fromkeys(unknown)


def test_record__needs_all_that_was_always_measured() -> None:
    line = json.loads(RECORD.to_json())
    del line["n_actions"]
    with pytest.raises(ValueError, match="expected an object with the keys"):
        Record.from_json(json.dumps(line))
