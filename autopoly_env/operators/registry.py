"""The registry of topological operators, and the presets; names and effects are those of Blender's operators."""

from collections.abc import Iterable

from autopoly_env import outside
from autopoly_env.errors import ConfigError
from autopoly_env.operators.edge_cap import edge_cap
from autopoly_env.operators.edge_dissolve import edge_dissolve
from autopoly_env.operators.edge_extrude import edge_extrude
from autopoly_env.operators.edge_fill import edge_fill
from autopoly_env.operators.edge_subdivide import edge_subdivide
from autopoly_env.operators.face_delete import face_delete
from autopoly_env.operators.face_hole import face_hole
from autopoly_env.operators.face_inset import face_inset
from autopoly_env.operators.face_split import face_split
from autopoly_env.operators.loop_cut import loop_cut
from autopoly_env.operators.operator import Operator
from autopoly_env.operators.vertex_dissolve import vertex_dissolve
from autopoly_env.operators.vertex_merge import vertex_merge
from autopoly_env.shown import short

_PAPER = (edge_subdivide, edge_extrude, face_split, face_delete)
_FULL = (*_PAPER, face_hole, vertex_dissolve, edge_dissolve)
_BUILDING = (edge_extrude, edge_cap, edge_fill, vertex_merge, loop_cut, face_inset)
_MODELLER = (*_BUILDING, face_delete, vertex_dissolve, edge_dissolve)
PRESETS: dict[str, tuple[Operator, ...]] = {"paper": _PAPER, "full": _FULL, "modeller": _MODELLER}
OPERATORS: dict[str, Operator] = {operator.name: operator for operator in (*_FULL, *_MODELLER)}  # all that are known


def register(operator: Operator) -> Operator:
    """Make an operator known by its name to everything in this process; returns it.

    Raises ConfigError for a name that another operator has, or that is no word.
    """
    if not operator.name.isidentifier() or operator.name in PRESETS or operator.name == "stop":
        raise ConfigError(
            f"an operator cannot be called {operator.name!r}; give it a name of its own, such as edge_cap"
        )
    known = OPERATORS.setdefault(operator.name, operator)
    if known is not operator and known != operator:
        raise ConfigError(f"{operator.name!r} is an operator of {known.module} already; give yours another name")
    return known


def operator_named(name: str) -> Operator:
    """The operator of that name. Raises ConfigError if there is none."""
    if name not in OPERATORS:
        raise ConfigError(
            f"operator {name!r} is unknown; give names from {', '.join(OPERATORS)}, or one of your own as "
            f"my.module:{name if name.isidentifier() else 'my_operator'}"
        )
    return OPERATORS[name]


def preset(given: str | Iterable[str | Operator]) -> tuple[Operator, ...]:
    """The operators that are asked for, in that order: presets ("paper", "full"), names, or `my.module:my_operator`,
    with commas between them or as a list, in which operators themselves may stand, too.

    Those of one's own are registered. Raises ConfigError for what is none of these, and an operator named twice.
    """
    if not isinstance(given, Iterable):
        raise ConfigError(f"operators {short(given)}: expected a preset, names, or a list of names and Operators")
    parts = [part.strip() for part in given.split(",")] if isinstance(given, str) else list(given)
    found: list[Operator] = []
    for part in parts:
        found += _asked_for(part)
    names = [operator.name for operator in found]
    twice = [name for k, name in enumerate(names) if name in names[:k]]
    if twice:
        raise ConfigError(f"operators {_shown(given)}: {twice[0]} stands there twice; name it once")
    return tuple(found)


def _asked_for(part: str | Operator) -> tuple[Operator, ...]:
    if isinstance(part, Operator):
        return (register(part),)
    if not isinstance(part, str):
        raise ConfigError(f"operator {short(part)}: expected a name or an Operator")
    if part in PRESETS:
        return PRESETS[part]
    if ":" in part:
        return (register(_imported(part)),)
    if part not in OPERATORS:
        raise ConfigError(
            f"operators {short(part)} are unknown; give some of {', '.join((*PRESETS, *OPERATORS))} with commas "
            "between them, or one of your own as my.module:my_operator"
        )
    return (OPERATORS[part],)


def _imported(place: str) -> Operator:
    """The operator at `my.module:my_operator`."""
    operator = outside.load(place, "operator")
    if not isinstance(operator, Operator):
        raise ConfigError(f"{place} is a {type(operator).__name__}; expected an autopoly_env.operators.Operator")
    return operator


def _shown(given: str | Iterable[str | Operator]) -> str:
    return repr(given if isinstance(given, str) else [getattr(part, "name", part) for part in given])
