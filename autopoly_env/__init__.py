"""The world: what a mesh is, what an action does, what it is worth."""

__version__ = "0.1.0"
