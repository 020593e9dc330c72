"""Requests that are over: how many of which kind, how long they took, and a line of a log for each."""

import json
import logging
import sys
import time
from bisect import bisect_left
from collections import Counter, defaultdict
from logging.handlers import WatchedFileHandler
from pathlib import Path
from typing import Any

from dnnvss.studio.page import Seen

EDGES = (0.05, 0.15, 0.5, 1.0, 1.5, 5.0, 30.0)
"""Upper edges of the classes of seconds that are counted."""


class Requests:
    """Counts requests, and writes each as a line of JSON.

    A line has the time, what of :class:`~dnnvss.studio.page.Seen`, and nothing that a user wrote unless that is
    asked for.

    Args:
        log: a file, which is opened anew when it was moved away; ``-`` is the terminal; None for no log.
        texts: also what is said.
    """

    def __init__(self, log: Path | None = None, texts: bool = False) -> None:
        self._counts, self._seconds = (
            Counter[tuple[str, str, int]](),
            defaultdict[str, float](float),
        )
        self._classes = defaultdict[str, list[int]](lambda: [0] * (len(EDGES) + 1))
        self._texts, self._handler = texts, None if log is None else _handler(log)

    def texts(self, text: str) -> dict[str, str]:
        """What of a text goes into the notes of its request."""
        return {"text": text} if self._texts else {}

    def seen(self, seen: Seen) -> None:
        """Count a request, and write of it."""
        self._counts[seen.method, seen.route, seen.status] += 1
        self._seconds[seen.route] += seen.seconds
        self._classes[seen.route][bisect_left(EDGES, seen.seconds)] += 1
        if self._handler is not None:
            self._handler.emit(logging.makeLogRecord({"msg": _line(seen), "levelno": logging.INFO}))

    def told(self) -> str:
        """Counts and seconds in the text form of Prometheus."""
        lines = [
            f'dnnvss_requests_total{{method="{method}",route="{route}",status="{status}"}} {count}'
            for (method, route, status), count in sorted(self._counts.items())
        ]
        for route, classes in sorted(self._classes.items()):
            for edge, upto in zip((*EDGES, "+Inf"), _running(classes), strict=True):
                lines.append(f'dnnvss_request_seconds_bucket{{route="{route}",le="{edge}"}} {upto}')
            lines += [
                f'dnnvss_request_seconds_sum{{route="{route}"}} {self._seconds[route]:.3f}',
                f'dnnvss_request_seconds_count{{route="{route}"}} {sum(classes)}',
            ]
        return "\n".join([*lines, ""])

    def close(self) -> None:
        """Write no more."""
        if self._handler is not None:
            self._handler.close()
            self._handler = None


def _handler(log: Path) -> logging.Handler:
    return (
        logging.StreamHandler(sys.stderr)
        if str(log) == "-"
        else WatchedFileHandler(log, encoding="utf-8")
    )


def _line(seen: Seen) -> str:
    when = time.strftime("%Y-%m-%dT%H:%M:%S", time.gmtime()) + "Z"
    told: dict[str, Any] = {
        "time": when,
        "method": seen.method,
        "route": seen.route,
        "status": seen.status,
        "seconds": round(seen.seconds, 4),
        "received": seen.received,
        "sent": seen.sent,
        **seen.notes,
    }
    return json.dumps(told)


def _running(counts: list[int]) -> list[int]:
    return [sum(counts[: k + 1]) for k in range(len(counts))]
