"""What an operator is: one value that says everything about it, from what it does to how it is told.

Only what it does has to be given: every other field has a default that is safe, if plain. An operator of one's own is
made in one file and named once, in `register` or as `my.module:my_operator` wherever operators are asked for.
"""

import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from importlib import import_module
from itertools import islice
from typing import Any, SupportsFloat, SupportsIndex

import numpy as np

from autopoly_env.arrays import BoolArray, FloatArray, IntArray
from autopoly_env.errors import AutoPolyError, ConformanceError
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators.action import Action, Choice, Start
from autopoly_env.operators.choices import ChoiceCodec
from autopoly_env.operators.elements import ElementKind
from autopoly_env.operators.evidence import Evidence
from autopoly_env.operators.rebuilding import refusal
from autopoly_env.operators.wording import Phrases, phrases_of

_REMOVAL_PROMISE = 0.02  # of the largest blame: nothing can be known of a removal before the refit


def _nothing_to_choose(_mesh: PolyMesh, _element: int) -> None:
    return None


def _always(_mesh: PolyMesh, _element: int) -> bool:
    return True


def _found_at(module: str, name: str) -> Any:
    return getattr(import_module(module), name)


@dataclass(frozen=True)
class Mirroring:
    """What the mirror image of an action is to be found for."""

    mesh: PolyMesh  # before the action; its outline is symmetric
    images: IntArray  # (V,) the mirror image of each of its boundary vertices, -1 for the others
    axis: float  # x of the axis
    action: Action


@dataclass(frozen=True)
class Operator:
    """One topological operator."""

    name: str
    element: ElementKind
    effect: str  # in words
    changes: tuple[tuple[int, int, int], ...]  # of (V, E, F), at most; element e has changes[e % len(changes)]
    mask: Callable[[PolyMesh], BoolArray]  # (n,) bool for the mesh's n elements: where `apply` works
    edit: Callable[[PolyMesh, int, Choice | None], PolyMesh]  # what `apply` calls: new elements last, with new ids
    # What is left free: what `apply` chooses by default, and how a sequence writes it; None where nothing is
    choose: Callable[[PolyMesh, int], Choice | None] = _nothing_to_choose
    choice: ChoiceCodec | None = None
    # At most, of (V, E, F), where that is not one number for all elements or choices; None: as `changes` says
    varies: Callable[[PolyMesh, int], tuple[int, int, int]] | None = None
    # Whether it changes what is rendered; if not, a refit has nothing to gain
    shows: Callable[[PolyMesh, int], bool] = _always
    # Starts of a refit at what the picture still misses, or shows too much of, before the operator's own
    begin: Callable[[Evidence, int], Iterator[Start]] | None = None
    # The area (unit square) that it may put right, for a prior; None: little for what removes or does not show
    promise: Callable[[Evidence, int], float] | None = None
    # The start followed by the mirror image of the action; None: illegal under symmetry, unless it does not show
    mirror: Callable[[Mirroring, Start], Iterator[Start]] | None = None
    # (n, 2) where each new vertex grows out of when it is drawn step by step; None: where the operator puts it
    sources: Callable[[PolyMesh, int, Choice | None, PolyMesh], FloatArray] | None = None
    takes: str = (
        ""  # of "all", "edge", "vertex": what a drawing shows to vanish; the rest becomes part of something else
    )
    phrases: Phrases | None = None  # None: a sentence about `effect`
    # What Blender's function of this name is called with (ids, and places that are lists of points); None: not there
    blender: Callable[[PolyMesh, int, Choice | None], list[Any]] | None = None
    blender_code: str = field(default="", repr=False)  # that function, where our own script does not have it

    @cached_property
    def module(self) -> str:
        """The module that it comes from, for messages."""
        return str(getattr(self.edit, "__module__", "an unknown module"))

    def change_at(self, mesh: PolyMesh, element: int) -> tuple[int, int, int]:
        """The change of (V, E, F), at most, when it works on an element."""
        return self.changes[element % len(self.changes)] if self.varies is None else self.varies(mesh, element)

    @property
    def removes(self) -> bool:
        """Whether it only takes away."""
        return all(max(change) <= 0 and min(change) < 0 for change in self.changes)

    @property
    def classes(self) -> tuple[str, ...]:
        """What a classifier of actions tells apart: the name, once for each variant of its element."""
        return tuple(f"{self.name}_{variant}" if variant else self.name for variant in self.element.variants)

    @property
    def told(self) -> Phrases:
        """What there is to say about its steps."""
        return self.phrases or phrases_of(self.name, self.effect)

    def legal_mask(self, mesh: PolyMesh) -> BoolArray:
        """(n,) of the mesh's n elements of the operator's kind those on which it works. Raises ConformanceError."""
        mask = self._own(self.mask, mesh)
        n = self.element.count(mesh)
        if not isinstance(mask, np.ndarray) or mask.shape != (n,) or mask.dtype != np.bool_:
            found = f"{mask.shape} {mask.dtype}" if isinstance(mask, np.ndarray) else type(mask).__name__
            raise self._broken(f"its mask is {found}; expected ({n},) bool, one for each {self.element.name}")
        return mask

    def apply(self, mesh: PolyMesh, element: int, choice: Choice | None = None) -> PolyMesh:
        """The mesh after the operator has worked on `element`, with `choice` or what `choose` gives.

        Raises IllegalActionError if the element or the choice does not allow it, ConformanceError if the operator
        breaks down.
        """
        n = self.element.count(mesh)
        if not 0 <= element < n:
            raise refusal(self.name, self.element.name, element, f"the mesh has {n}; give 0..{n - 1}")
        chosen = self.choice_at(mesh, int(element)) if choice is None else choice
        made: PolyMesh = self._own(self.edit, mesh, int(element), chosen)
        if not isinstance(made, PolyMesh):
            raise self._broken(f"it made a {type(made).__name__}; expected a PolyMesh")
        return made

    def choice_at(self, mesh: PolyMesh, element: int) -> Choice | None:
        """What `apply` chooses by default at `element`. Raises as `apply`."""
        chosen: Choice | None = self._own(self.choose, mesh, element)
        return chosen

    def shows_at(self, mesh: PolyMesh, element: int) -> bool:
        """Whether it changes what is rendered. Raises ConformanceError."""
        return bool(self._own(self.shows, mesh, element))

    def starts(self, evidence: Evidence, element: int, n_most: int | None = None) -> list[Start]:
        """The meshes from which to refit after it has worked on `element`, one or more, the first `n_most` at most.

        Raises as `apply`.
        """
        if self.begin is not None:
            found = self._started(self.begin, evidence, element, n_most=n_most)
            if not found:
                raise self._broken("it begins nowhere; expected one Start or more")
            return found
        choice = self.choice_at(evidence.mesh, element)
        return [Start(choice, self.apply(evidence.mesh, element, choice))]

    def mirrored(self, of: Mirroring, start: Start) -> list[Start]:
        """The start followed by the mirror image of the action, as often as there is room for it. Raises as `apply`."""
        return [] if self.mirror is None else self._started(self.mirror, of, start)

    def promise_of(self, evidence: Evidence, element: int) -> float:
        """The area (unit square) that it may put right at `element`, at least 0. Raises ConformanceError."""
        if self.promise is None:
            return _REMOVAL_PROMISE * max(evidence.most) if self.removes else 0.0
        promised: float = self._own(self.promise, evidence, element)
        if not (isinstance(promised, SupportsFloat) and 0.0 <= float(promised) < np.inf):
            raise self._broken(f"it promises {promised!r:.40}; expected an area of at least 0")
        return promised

    def sources_of(self, before: PolyMesh, element: int, choice: Choice | None, made: PolyMesh) -> FloatArray:
        """(n, 2) where each of the n vertices that it made grows out of. Raises ConformanceError."""
        if self.sources is not None:
            places: FloatArray = self._own(self.sources, before, element, choice, made)
            return places
        return made.vertices[[v for v, name in enumerate(made.vertex_ids) if name >= before.next_vertex_id]]

    def __reduce_ex__(self, protocol: SupportsIndex) -> str | tuple[Any, ...]:
        """Pickled by where it is found, as functions are; only what is nowhere goes as a whole."""
        for name, value in vars(sys.modules.get(self.module, object)).items():
            if value is self:
                return _found_at, (self.module, name)
        return super().__reduce_ex__(protocol)

    def _started(
        self, begin: Callable[..., Iterator[Start]], *arguments: Any, n_most: int | None = None
    ) -> list[Start]:
        """The starts that one of the operator's functions gives, one after the other."""
        found: list[Start] = self._own(lambda: list(islice(begin(*arguments), n_most)))
        odd = [one for one in found if not (isinstance(one, Start) and isinstance(one.mesh, PolyMesh))]
        if odd:
            raise self._broken(f"it begins at {odd[0]!r:.40}; expected a Start with a PolyMesh")
        return found

    def _own(self, call: Callable[..., Any], *arguments: Any) -> Any:
        """What one of the operator's functions returns; whatever else it raises is told in one line."""
        try:
            return call(*arguments)
        except AutoPolyError:
            raise
        except Exception as error:
            raise self._broken(f"{type(error).__name__}: {error}") from error

    def _broken(self, how: str) -> ConformanceError:
        return ConformanceError(
            f"operator {self.name!r} of {self.module} breaks its contract ({how}); "
            "autopoly_env.conformance.check_operator shows where"
        )
