"""The pages in docs/."""

from docs import draw_guidance


def test_pictures__are_those_that_the_text_shows() -> None:
    text = (draw_guidance.PICTURES.parent / "guidance.md").read_text(encoding="utf-8")
    drawn = {f"guidance-{name}.png" for name in draw_guidance.DRAWINGS}
    assert drawn == {path.name for path in draw_guidance.PICTURES.glob("guidance-*.png")}
    assert all(f"(pictures/{name})" in text for name in drawn)
