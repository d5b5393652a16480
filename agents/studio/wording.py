"""Notes that name options of commands, in the words of the page, for those who type none."""

import re

_WORDS = (
    (r"--keep (holes|parts)", r"“Keep: all \1”"),
    (r"--keep all", "“Keep: holes and parts”"),
    (r"--style paper (?=--w-sc)", "“Few faces, best score” at "),
    (r"--style paper", "“Few faces, best score”"),
    (r"--w-sc ([\d.]+)", r"a price of \1"),
    (r"--object (dark|light)", r"“Object: what is \1”"),
    (r"--object alpha", "“Object: what is opaque”"),
    (r"--object\b", "another choice of “Object”"),
    (r"--alpha-threshold ([\d.]+)", r"“Opaque from this alpha on” at \1"),
    (r"--background '([^']*)'", r"“The background is this colour”, \1, and"),
    (r"--threshold ([\d.]+)", r"“Threshold by hand” at \1"),
    (r"--threshold\b", "“Threshold by hand”"),
    (r"; all steps with --layers", ""),
    (r"with --depth\b", "with a thickness"),
    (r"--depth\b", "a thickness"),
)


def in_words(told: str) -> str:
    """A note or a line of help without options; those that the page has nothing for stay as they are.

    >>> in_words("the picture has 1 hole, the mesh none: --keep holes keeps them")
    'the picture has 1 hole, the mesh none: “Keep: all holes” keeps them'
    """
    for option, words in _WORDS:
        told = re.sub(option, words, told)
    return told
