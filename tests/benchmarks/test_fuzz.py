"""Odd inputs and random play, a few of each: `python -m benchmarks.fuzz` tries as many as one likes."""

import json

import numpy as np
import pytest

from autopoly_env.mesh import FaceRule
from benchmarks.fuzz.__main__ import GAMES
from benchmarks.fuzz.inputs import DOORS
from benchmarks.fuzz.odd import VALUES, damaged, mutated, places_in
from benchmarks.fuzz.play import play_many
from benchmarks.fuzz.tally import Tally, fuzz, table, try_one

INPUTS = {"sequence": 120, "array": 60, "option": 120, "simulator": 60, "environment": 30, "yaml": 20, "command": 3}


@pytest.mark.slow
@pytest.mark.parametrize("name", DOORS)
def test_odd_inputs__are_accepted_or_refused_in_one_tame_line(name: str) -> None:
    tally = Tally()
    for number in range(INPUTS[name]):
        try_one(tally, name, 11, number)
    assert tally.is_sound, tally.shown
    assert tally.n_inputs == INPUTS[name] == tally.n_accepted + tally.n_refused
    assert tally.n_refused > 0


@pytest.mark.slow  # 40 episodes
@pytest.mark.parametrize("operators, faces", GAMES)
def test_random_play__never_ends_a_legal_action_in_a_crossing_or_a_flipped_face(
    operators: str, faces: FaceRule
) -> None:
    played = play_many(operators, 40, 300, faces)
    assert (played.n_episodes, played.n_crossed, played.n_flipped) == (40, 0, 0)
    assert played.n_steps > 300


def test_tally__tells_what_was_not_as_promised(monkeypatch: pytest.MonkeyPatch) -> None:
    def breaks(_: np.random.Generator) -> None:
        raise ZeroDivisionError("oh")

    monkeypatch.setitem(DOORS, "sequence", (breaks, 140))
    tallies = fuzz(5, 0)
    assert tallies["sequence"].n_others == sum(tally.n_inputs for tally in tallies.values()) - sum(
        tally.n_accepted + tally.n_refused for tally in tallies.values()
    )
    assert not tallies["sequence"].is_sound
    assert "ZeroDivisionError: 'oh'" in table(tallies)


def test_mutated__is_another_document_and_leaves_the_given_one_alone() -> None:
    document = {"a": [1, 2, {"b": "c"}], "d": None}
    before = json.dumps(document)
    rng = np.random.default_rng(0)
    made = [mutated(rng, document) for _ in range(60)]
    assert json.dumps(document) == before
    assert sum(one != document for one in made) > 40
    assert places_in(document) == [(), ("a",), ("a", 0), ("a", 1), ("a", 2), ("a", 2, "b"), ("d",)]


def test_damaged__is_mostly_another_text() -> None:
    rng = np.random.default_rng(0)
    assert sum(damaged(rng, "abcdefgh") != "abcdefgh" for _ in range(100)) > 60
    assert damaged(rng, "") == ""
    assert len(VALUES) > 40
