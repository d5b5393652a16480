"""`--columns`: which numbers the table of a command shows."""

from collections.abc import Collection

from autopoly_env.errors import ConfigError

LESSON = ("actions", "valid", "blocking_in", "moved", "quads", "ngons", "concave", "effort", "returns")


def read_columns(given: str, known: Collection[str], default: Collection[str]) -> tuple[str, ...]:
    """The names that are asked for with commas between them; the default for none.

    `lesson` stands for LESSON, `all` for all that are known.
    Raises ConfigError for a name that is not known and for one that stands there twice.
    """
    names: list[str] = []
    for name in given.split(",") if given else default:
        names += {"lesson": LESSON, "all": tuple(known)}.get(name.strip(), (name.strip(),))
    for name in names:
        if name not in known:
            raise ConfigError(f"--columns {given}: {name!r} is none; give some of all, lesson, {', '.join(known)}")
        if names.count(name) > 1:
            raise ConfigError(f"--columns {given}: {name} stands there twice; name it once")
    return tuple(names)
