"""What the page says instead of options."""

import pytest

from agents.studio.taking import kinds
from agents.studio.wording import in_words


@pytest.mark.parametrize(
    ("told", "words"),
    [
        (": --keep all keeps them", ": “Keep: holes and parts” keeps them"),
        (": --style paper --w-sc 0.1 keeps them", ": “Few faces, best score” at a price of 0.1 keeps them"),
        ("inside out; --object dark turns it back", "inside out; “Object: what is dark” turns it back"),
        ("left out: --alpha-threshold 0.1 takes it in", "left out: “Opaque from this alpha on” at 0.1 takes it in"),
        (
            "faint: --background '#ffffff' --threshold 0.2 takes that in",
            "faint: “The background is this colour”, #ffffff, and “Threshold by hand” at 0.2 takes that in",
        ),
        ("the outline is soft: --threshold says where", "the outline is soft: “Threshold by hand” says where"),
        ("searched with --max-steps 40", "searched with --max-steps 40"),
        ("nothing --objective about it", "nothing --objective about it"),
    ],
)
def test_note__is_told_in_words_of_the_page(told: str, words: str) -> None:
    assert in_words(told) == words


def test_formats__are_told_without_options() -> None:
    assert not [made["help"] for made in kinds() if "--" in made["help"]]
