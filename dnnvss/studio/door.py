"""Who gets in: this machine's own pages, and who brings the token where others are let in."""

from collections.abc import Sequence
from dataclasses import dataclass
from hmac import compare_digest

from aiohttp import web

from dnnvss.studio.answers import Refused

READING = ("GET", "HEAD")
"""Methods that change nothing."""
_COOKIE = "dnnvss"


@dataclass(frozen=True)
class Door:
    """Lets requests in.

    Args:
        names: by which the server is reached, with their port, in lower case.
        origins: of its own pages.
        token: what every request has to bring, None where this machine alone gets in.
    """

    names: frozenset[str]
    origins: frozenset[str]
    token: str | None

    @classmethod
    def of(cls, host: str, port: int, token: str | None, others: Sequence[str]) -> "Door":
        """The door of a server.

        Args:
            host: the address it listens on.
            port: that it listens on.
            token: see above.
            others: names of a proxy, with their port where it is not the usual one.
        """
        own = {host, "localhost"} if host == "127.0.0.1" else {host}
        names = {f"{name}:{port}" for name in own} | (own if port == 80 else set())
        origins = {f"http://{name}" for name in names}
        origins |= {f"{scheme}://{name.lower()}" for name in others for scheme in ("http", "https")}
        return cls(frozenset(names | {name.lower() for name in others}), frozenset(origins), token)

    def check(self, request: web.BaseRequest) -> None:
        """Refuse what no page of this server sent: other names of this machine, and other pages in the browser.

        Raises:
            Refused: it is not let in.
        """
        if len(hosts := request.headers.getall("Host", [])) != 1 or hosts[0].lower() not in self.names:
            raise Refused(403, "this page is for this machine alone", close=True)
        self._check_token(request)
        if request.method not in READING:
            self.check_sender(request)

    def _check_token(self, request: web.BaseRequest) -> None:
        """Refuse who does not bring the token, where there is one."""
        brought = [request.headers.get("Authorization", "").removeprefix("Bearer "), request.cookies.get(_COOKIE, ""),
                   request.query.get("token", "") if request.path == "/" else ""]
        if self.token and not any(compare_digest(each.encode(), self.token.encode()) for each in brought):
            raise Refused(401, "the token is missing or wrong", close=True)

    def check_sender(self, request: web.BaseRequest) -> None:
        """Refuse what another page in the browser sent.

        Raises:
            Refused: it is not let in.
        """
        origins = request.headers.getall("Origin", [])
        if any(origin.lower() not in self.origins for origin in origins):
            raise Refused(403, "another page may not change anything here", close=True)
        if request.headers.get("Sec-Fetch-Site", "same-origin") not in ("same-origin", "none"):
            raise Refused(403, "another page may not change anything here", close=True)

    def remember(self, request: web.BaseRequest, answer: web.StreamResponse) -> None:
        """Leave the token, where the address brought it, in a cookie."""
        if self.token and request.query.get("token"):
            answer.set_cookie(_COOKIE, self.token, httponly=True, samesite="Strict")
