"""A line on the screen: as it is, whatever brackets it has, and tame, whatever it came from."""

from rich.console import Console

from autopoly_env.shown import tame


def say(console: Console, text: str) -> None:
    """Print one line, which a terminal may fold."""
    console.print(tame(text), markup=False, highlight=False, emoji=False, soft_wrap=True)
