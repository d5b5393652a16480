"""Constructions by hand in Blender: cards that say what to press and what Blender is like then, and their proof."""

from autopoly_env.export.byhand.cards import Card, cards_of, picks_of
from autopoly_env.export.byhand.hand import Line
from autopoly_env.export.byhand.proof import EVENTS, NEED_A_SCREEN, Proof, find_screen, prove

__all__ = ["EVENTS", "NEED_A_SCREEN", "Card", "Line", "Proof", "cards_of", "find_screen", "picks_of", "prove"]
