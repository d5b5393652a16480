"""`ConstructionSequence`: how a mesh was built, step by step; it replays bit for bit without a target."""

import json
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from autopoly_env.errors import AutoPolyError, ConfigError, MeshError, SequenceError
from autopoly_env.files import read_text, write_atomically
from autopoly_env.mesh import FaceRule, PolyMesh, Topology, check_faces, face_rule
from autopoly_env.operators import STOP, Action, Choice
from autopoly_env.operators.wording import element_words
from autopoly_env.sequence import variation
from autopoly_env.sequence.file import (
    MOST_BYTES,
    MOST_CORNERS,
    PlainScore,
    Step,
    check_label,
    check_score,
    dump_json,
    parse_json,
    plain_json,
)
from autopoly_env.sequence.follower import PointMap
from autopoly_env.sequence.ids import choice_ids, decoded, operator_named
from autopoly_env.shown import told

__all__ = ["ConstructionSequence", "Step"]

MOST_WORK = (
    10_000_000  # corners of all meshes of a construction: about 2 seconds of edges cut, and 300 MB where all are kept
)


@dataclass(frozen=True)
class ConstructionSequence:
    """A start mesh and the steps taken from it. What comes from outside is read with `load` or `from_json`."""

    settings: dict[str, Any]  # anything JSON knows: what a reader needs in order to understand the scores
    start: PolyMesh
    start_score: PlainScore
    steps: tuple[Step, ...] = ()

    @classmethod
    def record(
        cls,
        settings: dict[str, Any],
        start: PolyMesh,
        start_score: PlainScore,
        transitions: Iterable[tuple[Action, Choice | None, PolyMesh, PlainScore]],
    ) -> "ConstructionSequence":
        """The sequence of `transitions` (action, its choice, the mesh after it, that mesh's score) from `start`.

        A choice of None is recorded as what the operator chooses by default. STOP is left out: it changes
        nothing. Raises SequenceError if a mesh is not what its action makes of the one before it, moved
        vertices aside, and if one breaks the rule of faces that the settings name.
        """
        mesh, steps = start, []
        for number, (action, choice, after, score) in enumerate(transitions, 1):
            try:
                if action != STOP:
                    steps.append(_record_step(mesh, action, choice, after, _plain(score)))
                elif not np.array_equal(after.vertices, mesh.vertices):
                    raise SequenceError("the mesh changed under a stop; record what moved it")
            except AutoPolyError as error:
                raise SequenceError(f"step {number}: {error}") from None
            check_score(score, f"step {number}")
            mesh = after
        check_score(start_score, "start")
        sequence = cls(_plain(settings), start, _plain(start_score), tuple(steps))
        sequence._check_faces()
        return sequence

    @property
    def faces(self) -> FaceRule:
        """The rule of faces that the settings name; "any" where they name none. Raises SequenceError for another."""
        try:
            return face_rule(self.settings.get("faces", "any"))
        except ConfigError as error:
            raise SequenceError(f"settings: {error}") from None

    def under(self, faces: str | None) -> "ConstructionSequence":
        """The sequence under another rule of faces; itself for None.

        Raises SequenceError for a rule that there is not, and naming the first mesh and face that break it.
        """
        if faces is None:
            return self
        settings = {name: value for name, value in self.settings.items() if name != "faces"}
        ruled = replace(self, settings=settings if faces == "any" else {**settings, "faces": faces})
        ruled._check_faces()
        return ruled

    def _check_faces(self) -> None:
        """Raise SequenceError naming the first mesh that breaks the rule of faces."""
        if self.faces == "any":
            return
        for number, mesh in enumerate(self.replayed()):
            try:
                check_faces(mesh, self.faces, "the start mesh" if number == 0 else f"the mesh after step {number}")
            except MeshError as error:
                raise SequenceError(str(error)) from None

    def replayed(self) -> Iterator[PolyMesh]:
        """The start mesh and the mesh after each step, one at a time: no more than two are in memory at once.

        Raises SequenceError naming the step that fails, or with which it becomes too much: `MOST_CORNERS` in a mesh,
        `MOST_WORK` in all.
        """
        mesh, work = self.start, 0
        yield mesh
        for number, step in enumerate(self.steps, 1):
            try:
                made = _replay_step(mesh, step)
                n_corners = made.topology.n_corners
                work += n_corners
                if n_corners > MOST_CORNERS or work > MOST_WORK:
                    raise SequenceError(
                        f"the mesh has {n_corners} corners, {work} with those before it; expected at most "
                        f"{MOST_CORNERS} and {MOST_WORK}: give a shorter construction"
                    )
            except AutoPolyError as error:
                where = f"step {number}, {told(step.operator, 40)} {element_words(step)}"
                raise SequenceError(f"{where}: {error}") from None
            mesh = made
            yield _bare(mesh)

    @cached_property
    def _meshes(self) -> tuple[PolyMesh, ...]:
        return tuple(self.replayed())

    @cached_property
    def _final(self) -> PolyMesh:
        last = self.start
        for mesh in self.replayed():
            last = mesh
        return last

    def meshes(self) -> list[PolyMesh]:
        """All of `replayed`, kept."""
        return list(self._meshes)

    def final(self) -> PolyMesh:
        """The mesh after the last step."""
        return self._final

    def trim(self, n: int) -> "ConstructionSequence":
        """The first n steps. Raises SequenceError if there are not as many."""
        if not 0 <= n <= len(self.steps):
            raise SequenceError(f"cannot trim {len(self.steps)} steps to {n}; give 0..{len(self.steps)}")
        return replace(self, steps=self.steps[:n])

    def with_step(
        self,
        k: int,
        *,
        moved: Mapping[int, tuple[float, float]] | None = None,
        choice: Mapping[str, Any] | None = None,
        insert: Step | None = None,
        drop: bool = False,
    ) -> "ConstructionSequence":
        """An edit at step k, carried on to the end (docs/variations.md): one of three.

        `moved` takes vertices, by id, elsewhere after step k (0: in the start mesh) and `choice` replaces the step's
        own, one or both; `insert` is a step to take after step k; `drop` leaves step k out. Later steps are taken
        again. Raises SequenceError naming the step, this or a later one, that is illegal then.
        """
        lowest = 1 if drop or choice is not None else 0
        if not lowest <= k <= len(self.steps):
            raise SequenceError(f"step {k} of a sequence of {len(self.steps)}: give {lowest}..{len(self.steps)}")
        if (moved is not None or choice is not None) + (insert is not None) + drop != 1:
            raise SequenceError("give one edit of a step: moved and choice, or insert, or drop")
        replayed, parts = self._replayed(), list(self.parts)
        if insert is not None:
            parts.insert(k, insert.part)
            return self.record(*variation.with_insertion(replayed, k, insert)).with_parts(parts)
        if drop:
            del parts[k - 1]
            return self.record(*variation.without(replayed, k)).with_parts(parts)
        return self.record(*variation.with_changes(replayed, k, moved or {}, choice)).with_parts(parts)

    @property
    def parts(self) -> tuple[str | None, ...]:
        """The label of the part that each step works on, None where the sequence does not say."""
        return tuple(step.part for step in self.steps)

    def with_parts(self, labels: Iterable[str | None]) -> "ConstructionSequence":
        """The same with other labels, one for each step: "body", "left leg 2", None to say nothing.

        Raises SequenceError for another number of labels and for one that cannot be kept (`check_label`).
        """
        labels = tuple(labels)
        if len(labels) != len(self.steps):
            raise SequenceError(f"{len(labels)} labels of parts for {len(self.steps)} steps; give one for each step")
        for number, label in enumerate(labels, 1):
            try:
                if label is not None:
                    check_label(label)
            except ValueError as error:
                raise SequenceError(f"step {number}: part is {label!r:.80}: {error}") from None
        steps = (replace(step, part=label) for step, label in zip(self.steps, labels, strict=True))
        return replace(self, steps=tuple(steps))

    def moved_by(self, place: Callable[[int], PointMap]) -> "ConstructionSequence":
        """The same steps, the points of mesh number i (0 is the start) going where `place(i)` takes them.

        Raises SequenceError naming the step that is illegal then.
        """
        return self.record(*variation.moved_by(self._replayed(), place)).with_parts(self.parts)

    def mirrored(self) -> "ConstructionSequence":
        """The mirror image at x = 1/2: the same actions on mirrored elements. Raises SequenceError as `moved_by`.

        In the labels of parts, left and right change places.
        """
        parts = [label and variation.mirrored_label(label) for label in self.parts]
        return self.record(*variation.mirrored(self._replayed())).with_parts(parts)

    def _replayed(self) -> variation.Replayed:
        return variation.Replayed(self.settings, self._meshes, self.steps)

    def best_prefix(self) -> "ConstructionSequence":
        """The steps up to the highest total score; of equals the shortest."""
        totals = [score["total"] for score in (self.start_score, *(step.score for step in self.steps))]
        return self.trim(totals.index(max(totals)))

    def diff(self, other: "ConstructionSequence") -> str:
        """What `other` has otherwise, a line each, as `what: here | there`; empty if nothing."""
        lines = [
            f"setting {key}: {self.settings.get(key, 'absent')} | {other.settings.get(key, 'absent')}"
            for key in sorted(self.settings.keys() | other.settings.keys())
            if self.settings.get(key) != other.settings.get(key)
        ]
        if (self.start, self.start_score) != (other.start, other.start_score):
            lines.append(f"start: {_start_words(self)} | {_start_words(other)}")
        for i in range(max(len(self.steps), len(other.steps))):
            here, there = self.steps[i : i + 1], other.steps[i : i + 1]
            if here != there:
                lines.append(f"step {i + 1}: {_step_words(here)} | {_step_words(there)}")
        return "\n".join(lines)

    def to_json(self) -> str:
        """The sequence as JSON text (docs/sequence-format.md). Raises SequenceError for NaN or infinity."""
        return dump_json(self.settings, self.start, self.start_score, self.steps)

    @classmethod
    def from_json(cls, text: str) -> "ConstructionSequence":
        """The sequence in a JSON text, replayed once as a check.

        Raises SequenceError if the text is damaged, of another format, cannot be replayed, or has a mesh that breaks
        the rule of faces that its settings name.
        """
        sequence = cls(*parse_json(text))
        sequence.final()
        sequence._check_faces()
        return sequence

    def _repr_html_(self) -> str:
        """The player, for notebooks."""
        from autopoly_env.export.player import to_frame

        return to_frame(self)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write `to_json` to a file, whole or not at all. Raises OutputError if it cannot be written."""
        write_atomically(path, self.to_json())

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> "ConstructionSequence":
        """The sequence in a file. Raises SequenceError as `from_json` does, or if it cannot be read."""
        try:
            text = read_text(path, MOST_BYTES)
        except OSError as error:
            raise SequenceError(
                f"cannot read {path} ({error.strerror}); give a construction sequence as saved"
            ) from None
        try:
            return cls.from_json(text)
        except SequenceError as error:
            raise SequenceError(f"{path}: {error}") from None


def _record_step(mesh: PolyMesh, action: Action, choice: Choice | None, after: PolyMesh, score: PlainScore) -> Step:
    operator, element = operator_named(action.operator), int(action.element)
    if choice is None:
        choice = operator.choice_at(mesh, element)
    made = operator.apply(mesh, element, choice)
    if made.with_vertices(after.vertices) != after:
        raise SequenceError(f"the mesh after it is not what {action.operator} makes; record every action")
    created, removed = _id_changes(mesh, made)
    is_moved = (made.vertices.view(np.int64) != after.vertices.view(np.int64)).any(axis=1)
    positions = zip(after.vertex_ids, after.vertices.tolist(), is_moved, strict=True)
    moved = tuple((name, x, y) for name, (x, y), differs in positions if differs)
    return Step(
        action.operator,
        operator.element.ids(mesh, element),
        choice_ids(mesh, operator, element, choice),
        created,
        removed,
        moved,
        score,
    )


def _replay_step(mesh: PolyMesh, step: Step) -> PolyMesh:
    operator, element, choice = decoded(mesh, step)
    made = operator.apply(mesh, element, choice)
    for what, expected, found in zip(
        ("creates", "removes"), _id_changes(mesh, made), (step.created, step.removed), strict=True
    ):
        if found != expected:
            raise SequenceError(f"{step.operator} {what} {expected}, but the step says {found}")
    if not step.moved:
        return made
    if len({name for name, _, _ in step.moved}) < len(step.moved):
        raise SequenceError("it moves a vertex twice; give each vertex one position")
    vertices = made.vertices.copy()
    for name, x, y in step.moved:
        vertices[made.vertex_index(name)] = x, y
    return made.with_vertices(vertices)


def _bare(mesh: PolyMesh) -> PolyMesh:
    """The mesh without what was derived from its topology on the way, which is twenty times as large."""
    return replace(mesh, topology=Topology(mesh.topology.n_vertices, mesh.faces))


def _id_changes(before: PolyMesh, after: PolyMesh) -> tuple[dict[str, list[int]], dict[str, list[int]]]:
    """The ids that came and those that went."""
    pairs = {
        "vertices": (before.vertex_ids, after.vertex_ids),
        "faces": (before.face_ids, after.face_ids),
    }
    created = {kind: _missing(new, old) for kind, (old, new) in pairs.items()}
    removed = {kind: _missing(old, new) for kind, (old, new) in pairs.items()}
    return created, removed


def _missing(ids: tuple[int, ...], others: tuple[int, ...]) -> list[int]:
    """Those of `ids` that are not among the others. Most operators put new ones after all others."""
    n = min(len(ids), len(others))
    return sorted(ids[n:]) if ids[:n] == others[:n] else sorted(set(ids).difference(others))


def _plain(values: dict[str, Any]) -> dict[str, Any]:
    """A copy with nothing in it but what comes back from JSON."""
    copied: dict[str, Any] = json.loads(plain_json(values))
    return copied


def _start_words(sequence: ConstructionSequence) -> str:
    return f"{sequence.start}, total {sequence.start_score['total']:.2f}"


def _step_words(steps: tuple[Step, ...]) -> str:
    if not steps:
        return "absent"
    (step,) = steps
    part = "" if step.part is None else f"{step.part}: "
    return f"{part}{step.operator} {element_words(step)}, {len(step.moved)} moved, total {step.score['total']:.2f}"
