"""Who may ask: only the page that was opened with the address that the command has printed.

A server on 127.0.0.1 can be reached by every page that the browser shows. So each request has to carry the random token
in its path, to name this server as its `Host` (else another name may have been made to lead here: DNS rebinding), and,
where the browser tells where it comes from, to come from here.
"""

import secrets

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

PAGE_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; "
    "form-action 'none'; base-uri 'none'; frame-ancestors 'none'"
)
HEADERS = {
    "content-security-policy": PAGE_POLICY,
    "x-content-type-options": "nosniff",
    "x-frame-options": "DENY",
    "referrer-policy": "no-referrer",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "cache-control": "no-store",
}
_OWN_SITE = ("same-origin", "none")  # `none`: an address that was typed, or opened from a program


class Guard:
    """Lets the app see only what may be asked, without the token; puts headers on all that it answers."""

    def __init__(self, app: ASGIApp, token: str, port: int, most_bytes: int) -> None:
        self._app, self._token, self._most_bytes = app, token, most_bytes
        self._hosts = {f"{name}:{port}" for name in ("127.0.0.1", "localhost")}
        if port == 80:
            self._hosts |= {"127.0.0.1", "localhost"}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        if scope["type"] != "http":  # a web socket is nothing that the page asks for
            await send({"type": "websocket.close", "code": 1008})
            return

        async def send_guarded(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                for name, value in HEADERS.items():
                    headers.setdefault(name, value)
            await send(message)

        refusal = self._refused(scope)
        if refusal is not None:
            await refusal(scope, receive, send_guarded)
            return
        root = f"/{self._token}"
        inner = {**scope, "path": scope["path"][len(root) :], "root_path": "", "raw_path": b""}
        await self._app(inner, receive, send_guarded)

    def _refused(self, scope: Scope) -> PlainTextResponse | None:
        """What a request that may not be is answered with."""
        headers = Headers(scope=scope)
        if headers.getlist("host") == [] or any(host not in self._hosts for host in headers.getlist("host")):
            return PlainTextResponse("This server answers to 127.0.0.1 and localhost alone.\n", 403)
        if any(origin.removeprefix("http://") not in self._hosts for origin in headers.getlist("origin")):
            return PlainTextResponse("This server answers its own page alone.\n", 403)
        if headers.get("sec-fetch-site", "none") not in _OWN_SITE:
            return PlainTextResponse("This server answers its own page alone.\n", 403)
        given = scope["path"].split("/", 2)
        if len(given) < 3 or not secrets.compare_digest(given[1].encode(), self._token.encode()):
            return PlainTextResponse("Open the address that `python -m agents.studio` has printed, all of it.\n", 403)
        length = headers.get("content-length", "0")
        if not length.isdigit() or int(length) > self._most_bytes:
            said = f"That is too large: at most {self._most_bytes // 1_000_000} MB a file.\n"
            return PlainTextResponse(said, 413, {"connection": "close"})
        return None
