"""The errors AutoPoly raises on purpose. Each message says what was given, what was expected and what to do."""

from autopoly_env.shown import told


class AutoPolyError(Exception):
    """Base of every error raised on purpose by this project.

    As text it is one line of at most 400 letters, in which nothing that was given acts on a terminal.
    """

    def __str__(self) -> str:
        return told(super().__str__())


class SilhouetteError(AutoPolyError):
    """An image that cannot serve as a target silhouette."""


class MeshError(AutoPolyError):
    """Vertices and faces that do not form a valid polygon mesh."""


class IllegalActionError(AutoPolyError):
    """A topological operator asked to work where it may not."""


class SequenceError(AutoPolyError):
    """A construction sequence that cannot be read or replayed."""


class ConfigError(AutoPolyError):
    """A setting that is unknown or out of range."""


class OutputError(AutoPolyError):
    """A result that cannot be written where it was asked to go."""


class RunError(AutoPolyError):
    """A folder of results that cannot be read, or that belongs to another run."""


class EpisodeError(AutoPolyError):
    """An environment used out of turn: before a reset, or after the episode's end."""


class WorkerError(AutoPolyError):
    """A worker process that has died, or is asked for something after its end."""


class ConformanceError(AutoPolyError):
    """A part that breaks one of the rules the others rely on."""
