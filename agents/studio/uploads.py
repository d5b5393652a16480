"""What is dropped on the page: its bytes within bounds, and what they are, before anything is decoded."""

import io
from dataclasses import dataclass, field, replace

from PIL import Image
from starlette.requests import Request

from agents.studio.sharing import Shared, read_shared
from autopoly_env.errors import SequenceError, SilhouetteError
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.sequence.variation import picture_of
from autopoly_env.shown import told
from autopoly_env.silhouette import DEFAULT_OPTIONS, ObjectOptions, Silhouette, load_silhouette, thumbnail

MOST_BYTES = 64_000_000  # of a file
MOST_PIXELS = 64_000_000  # of a picture
MOST_OF_FOLDER = 100  # bytes of a folder's name
SHOWN, SMALL = 1024, 96  # pixels a side at most: of the picture on the page, and in the list


class TooLargeError(Exception):
    """A body that has more bytes than it may have."""


@dataclass(frozen=True, eq=False)
class Opened:
    """A file that was read: a picture, a sequence or a shared file."""

    name: str
    silhouette: Silhouette | None  # None where no object was found, `problem` says why
    problem: str = ""
    picture: bytes | None = None  # as it was given; None for a sequence without one
    options: ObjectOptions = DEFAULT_OPTIONS
    sequence: ConstructionSequence | None = None
    shared: Shared | None = None
    shown: bytes = field(default=b"", repr=False)  # the picture as a PNG of at most SHOWN pixels a side
    small: bytes = field(default=b"", repr=False)

    def under(self, name: str) -> "Opened":
        """The same under another name."""
        silhouette = None if self.silhouette is None else replace(self.silhouette, name=name)
        return replace(self, name=name, silhouette=silhouette)


async def body_of(request: Request, most_bytes: int) -> bytes:
    """The body of a request. Raises TooLargeError as soon as it has more bytes, whatever it said before."""
    parts, size = [], 0
    async for part in request.stream():
        size += len(part)
        if size > most_bytes:
            raise TooLargeError(f"That is too large: at most {_in_words(most_bytes)}.")
        parts.append(part)
    return b"".join(parts)


def _in_words(n_bytes: int) -> str:
    return f"{n_bytes // 10**6} MB a file" if n_bytes >= 10**6 else f"{n_bytes:,} bytes of this"


def plain_name(text: str) -> str:
    """A name of at most 80 letters that can be shown, typed and sent, and of which no part is a folder."""
    kept = "".join(letter for letter in text if letter.isprintable() and letter not in "/\\")
    return kept.strip(" .")[:80] or "picture"


def folder_name(name: str) -> str:
    """A name that is a file's on every system, and of no other folder."""
    kept = "".join(letter if letter.isalnum() or letter in " -_.()" else "_" for letter in name).strip(" .")
    return begun(kept, MOST_OF_FOLDER) or "picture"


def begun(text: str, most_bytes: int) -> str:
    """As much of the text as has so many bytes."""
    return text.encode()[:most_bytes].decode("utf-8", "ignore")


def opened(name: str, data: bytes) -> Opened:
    """The picture, sequence or shared file in some bytes.

    Raises SilhouetteError for what is no picture or has too many pixels, SequenceError for a text that is neither.
    """
    if data.lstrip()[:1] == b"{":
        return _opened_text(name, data)
    try:
        return _opened_picture(name, data, DEFAULT_OPTIONS)
    except SilhouetteError as error:
        raise SilhouetteError(_named(error, name)) from None


def _opened_text(name: str, data: bytes) -> Opened:
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError:
        raise SequenceError(f"{name!r} is no text in UTF-8; give a picture, a sequence or a shared file") from None
    shared = read_shared(text)
    if shared is None:
        sequence = ConstructionSequence.from_json(text)
        return _without_picture(name, sequence)
    shared = replace(shared, name=plain_name(shared.name))
    if shared.picture is None:
        if shared.sequence is None:
            raise SequenceError(f"{name!r} holds neither a picture nor a construction")
        return replace(_without_picture(shared.name, shared.sequence), shared=shared)
    found = _opened_picture(shared.name, shared.picture, shared.options)
    return replace(found, sequence=shared.sequence, shared=shared)


def _without_picture(name: str, sequence: ConstructionSequence) -> Opened:
    """A construction, which stands for its own picture."""
    silhouette = picture_of(sequence.final(), name)
    small = Image.fromarray(~silhouette.mask).convert("L").resize((SMALL, SMALL))
    return Opened(name, silhouette, sequence=sequence, small=_png(small))


def _opened_picture(name: str, data: bytes, options: ObjectOptions) -> Opened:
    check_pixels(name, data)
    shown = thumbnail(io.BytesIO(data), SHOWN)
    small = shown.copy()
    small.thumbnail((SMALL, SMALL))
    found = reopened(name, data, options)
    return replace(found, picture=data, shown=_png(shown), small=_png(small))


def reopened(name: str, data: bytes, options: ObjectOptions) -> Opened:
    """The object that the options find in a picture that was opened before."""
    try:
        return Opened(name, load_silhouette(io.BytesIO(data), name=name, options=options), options=options)
    except SilhouetteError as error:  # it is a picture, and other options may find what is in it
        return Opened(name, None, _named(error, name), options=options)


def _named(error: SilhouetteError, name: str) -> str:
    """What is wrong with a picture, which the one who says so does not know by its name."""
    return str(error).replace("the given file object", repr(told(name, 60)))


def check_pixels(name: str, data: bytes) -> None:
    """Raise SilhouetteError if the header of a picture promises too many pixels; nothing is decoded for that."""
    try:
        width, height = Image.open(io.BytesIO(data)).size
    except Image.DecompressionBombError:
        width = height = MOST_PIXELS
    except Exception:  # no picture that Pillow knows: what it is will be said where it is read
        return
    if width * height > MOST_PIXELS:
        raise SilhouetteError(
            f"{told(name, 60)!r} has too many pixels; expected at most {MOST_PIXELS // 10**6} megapixels: scale it down"
        )


def _png(image: Image.Image) -> bytes:
    stream = io.BytesIO()
    image.save(stream, "PNG")
    return stream.getvalue()
