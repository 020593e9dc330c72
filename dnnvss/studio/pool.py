"""Workers behind one port: processes that do one thing at a time, are ended where they take too long, and replaced."""

import asyncio
import math
import os
import signal
import time
from collections import Counter, defaultdict
from collections.abc import AsyncIterator, Mapping, Sequence
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass, field
from typing import Any

from dnnvss.errors import DnnvssError
from dnnvss.studio.page import BusyError
from dnnvss.studio.wire import framed, receive

RATHER = 0.5
"""Seconds for which a job waits for the worker that knows what it is about, while others are free."""
_PAUSES = (0.1, 10.0)
"""Seconds until a worker is replaced: of one that has worked, and at most of those that end as they begin."""


@dataclass(frozen=True)
class PoolLimits:
    """How much is done at once, how much may wait, and for how long.

    Args:
        workers: processes.
        waiting: jobs that wait for one of them; further ones are refused.
        patience: seconds that a job waits.
        working: seconds that a job may take; then its worker is ended.
        leaving: seconds that a job may go on when nobody waits for it any more.
        tries: workers that may be lost over a job.
    """

    workers: int = 2
    waiting: int = 64
    patience: float = 30.0
    working: float = 120.0
    leaving: float = 5.0
    tries: int = 3


@dataclass(frozen=True)
class Done:
    """What a worker made of a job.

    Args:
        head, body: its answer.
        worker: the number of the process, which no other one has or had.
        tries: workers that were given it.
        waited: seconds until it was begun.
    """

    head: Mapping[str, Any]
    body: bytes
    worker: int
    tries: int
    waited: float


class _LostError(Exception):
    """A worker ended over a job."""


@dataclass(eq=False)
class _Worker:
    number: int
    process: asyncio.subprocess.Process
    busy: bool = False

    async def exchange(self, frame: bytes) -> tuple[dict[str, Any], bytes]:
        """Send a message and return the answer."""
        assert self.process.stdin is not None and self.process.stdout is not None
        try:
            self.process.stdin.write(frame)
            await self.process.stdin.drain()
            return await receive(self.process.stdout)
        except (OSError, EOFError, ValueError) as error:
            raise _LostError from error


@dataclass(eq=False)
class _Waiting:
    near: int | None
    since: float
    worker: asyncio.Future[_Worker] = field(
        default_factory=lambda: asyncio.get_running_loop().create_future()
    )


class Pool:
    """Workers that are given jobs: ``async with pool.working(): await pool.do(...)``.

    A job is done by one worker alone, which does nothing else meanwhile. One whose worker ends is given to another;
    what is asked of workers must therefore be such that it may be done twice.

    Args:
        command: starts a worker: it reads messages from its input and answers each, in order, on its output.
        greeting: the first message, which it answers when it is ready.
        limits: what may be asked of it.
    """

    def __init__(
        self, command: Sequence[str], greeting: Mapping[str, Any], limits: PoolLimits
    ) -> None:
        self._command, self._greeting, self.limits = command, framed(greeting), limits
        self._workers, self._waiting, self._number = dict[int, _Worker](), list[_Waiting](), 0
        self.counts, self.seconds = Counter[str](), defaultdict[str, float](float)

    @asynccontextmanager
    async def working(self) -> AsyncIterator[None]:
        """Have the workers in the block; each that ends is replaced."""
        keepers = [asyncio.create_task(self._keep()) for _ in range(self.limits.workers)]
        try:
            yield
        finally:
            for keeper in keepers:
                keeper.cancel()
            await asyncio.gather(*keepers, return_exceptions=True)

    @property
    def ready(self) -> int:
        """Workers that are there."""
        return len(self._workers)

    @property
    def inside(self) -> int:
        """Jobs that are worked on or wait."""
        return len(self._waiting) + sum(worker.busy for worker in self._workers.values())

    async def do(self, job: Mapping[str, Any], near: int | None = None) -> Done:
        """What a worker makes of a job.

        Args:
            job: what it is sent; ``job`` in it names the kind.
            near: the worker that knows best what it is about, if it is still there.

        Raises:
            BusyError: too many wait, it waited too long, or workers were lost over it.
            DnnvssError: what the worker says is wrong with it, or it took too long.
        """
        frame, asked = framed(job), time.monotonic()
        for tries in range(1, self.limits.tries + 1):
            worker = await self._free(near)
            begun = time.monotonic()
            try:
                head, body = await self._given(worker, frame)
            except _LostError:
                self.counts["again"] += 1
                continue
            self.counts[str(job["job"])] += 1
            self.seconds[str(job["job"])] += time.monotonic() - begun
            _raise_wrong(head)
            return Done(head, body, worker.number, tries, begun - asked)
        raise self._busy(
            "workers were lost over this", "Ask again in a moment, or for less at a time"
        )

    def _busy(self, why: str, remedy: str = "Ask again in a moment") -> BusyError:
        self.counts["refused"] += 1
        done = sum(self.counts[name] for name in self.seconds)
        each = sum(self.seconds.values()) / done if done else 1.0
        return BusyError(why, remedy=remedy).after(
            math.ceil(len(self._waiting) * each / max(1, len(self._workers)))
        )

    async def _free(self, near: int | None) -> _Worker:
        """A worker, which is busy from now on."""
        loop, waiting = asyncio.get_running_loop(), _Waiting(near, time.monotonic())
        self._waiting.append(waiting)
        self._match()
        if not waiting.worker.done() and len(self._waiting) > self.limits.waiting:
            self._waiting.remove(waiting)
            raise self._busy("too many are waiting")
        if near is not None and not waiting.worker.done():
            loop.call_later(RATHER + 0.01, self._match)
        try:
            async with asyncio.timeout(self.limits.patience):
                return await waiting.worker
        except (TimeoutError, asyncio.CancelledError) as error:
            if waiting in self._waiting:
                self._waiting.remove(waiting)
            elif waiting.worker.done() and not waiting.worker.cancelled():
                self._release(waiting.worker.result())
            if isinstance(error, TimeoutError):
                raise self._busy("waited too long") from None
            raise

    def _match(self) -> None:
        """Give free workers to who has waited longest, rather to those whose takes they keep."""
        now = time.monotonic()
        for worker in [each for each in self._workers.values() if not each.busy]:
            waiting = [each for each in self._waiting if not each.worker.done()]
            own = [
                each
                for each in waiting
                if each.near not in self._workers or each.near == worker.number
            ]
            late = [each for each in waiting if now - each.since > RATHER]
            for chosen in (own or late)[:1]:
                self._waiting.remove(chosen)
                worker.busy = True
                chosen.worker.set_result(worker)

    def _release(self, worker: _Worker) -> None:
        worker.busy = False
        self._match()

    async def _given(self, worker: _Worker, frame: bytes) -> tuple[dict[str, Any], bytes]:
        """The answer of a worker that is busy with this; it is free again when it has answered."""
        work = asyncio.ensure_future(worker.exchange(frame))
        work.add_done_callback(lambda done: self._over(worker, done))
        try:
            async with asyncio.timeout(self.limits.working):
                return await asyncio.shield(work)
        except TimeoutError:
            self.counts["late"] += 1
            self._drop(worker)
            raise DnnvssError(
                f"this took longer than {self.limits.working:g} s and was ended",
                remedy="Ask for less at a time",
            ) from None
        except asyncio.CancelledError:
            self.counts["left"] += 1
            asyncio.get_running_loop().call_later(self.limits.leaving, self._give_up, worker, work)
            raise

    def _give_up(self, worker: _Worker, work: "asyncio.Future[Any]") -> None:
        """End a worker that is still at work for nobody."""
        if not work.done():
            self._drop(worker)

    def _over(self, worker: _Worker, work: "asyncio.Future[Any]") -> None:
        if work.cancelled() or work.exception() is not None:
            self._drop(worker)
        else:
            self._release(worker)

    def _drop(self, worker: _Worker) -> None:
        """End a worker; its keeper replaces it."""
        self._workers.pop(worker.number, None)
        kill(worker.process)
        self._match()

    async def _keep(self) -> None:
        """Have one worker, and another one when it has ended."""
        pause = _PAUSES[0]
        while True:
            begun = time.monotonic()
            await self._one()
            self.counts["replaced"] += 1
            pause = (
                _PAUSES[0] if time.monotonic() - begun > _PAUSES[1] else min(2 * pause, _PAUSES[1])
            )
            await asyncio.sleep(pause)

    async def _one(self) -> None:
        """Have one worker until it ends; it keeps one processor busy, and no threads that wait for each other."""
        process = await asyncio.create_subprocess_exec(
            *self._command,
            stdin=asyncio.subprocess.PIPE,
            stdout=asyncio.subprocess.PIPE,
            env={"OMP_NUM_THREADS": "1", **os.environ},
            start_new_session=True,
        )
        self._number += 1
        worker = _Worker(self._number, process)
        try:
            with suppress(_LostError):
                await worker.exchange(self._greeting)
                self._workers[worker.number] = worker
                self._match()
            await process.wait()
        finally:
            self._drop(worker)
            await asyncio.shield(process.wait())

    def told(self) -> str:
        """Counts and seconds in the text form of Prometheus."""
        lines = [
            f"dnnvss_workers {self.ready}",
            f"dnnvss_work_inside {self.inside}",
            f"dnnvss_work_waiting {len(self._waiting)}",
        ]
        lines += [
            f'dnnvss_work_total{{task="{name}"}} {count}'
            for name, count in sorted(self.counts.items())
        ]
        lines += [
            f'dnnvss_work_seconds_total{{task="{name}"}} {seconds:.3f}'
            for name, seconds in sorted(self.seconds.items())
        ]
        return "\n".join([*lines, ""])


def kill(process: asyncio.subprocess.Process) -> None:
    """End a process that was started in a session of its own, whatever it does, and all that it started."""
    if process.returncode is None:
        with suppress(ProcessLookupError):  # its own kill() would take its status from who waits for it
            os.killpg(process.pid, signal.SIGKILL)


def _raise_wrong(head: Mapping[str, Any]) -> None:
    """Raise what a worker says is wrong."""
    if "wrong" in head:
        raise (BusyError if head.get("short") else DnnvssError)(**head["wrong"])
    if "failed" in head:
        raise RuntimeError("a worker failed at this; the traceback stands above")
