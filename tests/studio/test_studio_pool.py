"""Workers behind one port: lost ones, slow ones, full queues, and listeners who leave."""

import asyncio
import os
import signal
import time
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest
from studio.stand_in import COMMAND

from dnnvss.errors import DnnvssError
from dnnvss.studio.page import BusyError
from dnnvss.studio.pool import Done, Pool, PoolLimits


def run(limits: PoolLimits, work: Callable[[Pool], Awaitable[Any]], **greeting: Any) -> Any:
    async def all_of_it() -> Any:
        pool = Pool(COMMAND, greeting, limits)
        async with pool.working():
            return await work(pool)

    return asyncio.run(all_of_it())


async def ready(pool: Pool) -> None:
    async with asyncio.timeout(20):
        while pool.ready < pool.limits.workers:
            await asyncio.sleep(0.01)


def job(**more: Any) -> dict[str, Any]:
    return {"job": "test", **more}


def process(done: Done) -> int:
    return int(done.body)


def test_each_gets_what_it_asked_for_and_as_many_work_as_there_are_workers() -> None:
    async def work(pool: Pool) -> None:
        await ready(pool)
        done = await asyncio.gather(*(pool.do(job(say=k, sleep=0.05)) for k in range(8)))
        assert [each.head["said"] for each in done] == list(range(8))
        assert len({process(each) for each in done}) == 2
        assert pool.counts["test"] == 8 and pool.inside == 0
        assert 'dnnvss_work_total{task="test"} 8' in pool.told()

    run(PoolLimits(workers=2), work)


def test_a_job_is_done_again_by_another_worker_where_its_own_ends(tmp_path: Path) -> None:
    async def work(pool: Pool) -> None:
        await ready(pool)
        others = [pool.do(job(say=k, sleep=0.02)) for k in range(10)]
        done = await asyncio.gather(pool.do(job(say="x", once=str(tmp_path / "once"))), *others)
        assert done[0].head["said"] == "x" and done[0].tries == 2
        assert [each.head["said"] for each in done[1:]] == list(range(10))
        await ready(pool)
        assert pool.counts["replaced"] == 1 and pool.counts["again"] == 1

    run(PoolLimits(workers=2), work)


def test_workers_that_are_killed_are_replaced_and_nothing_is_lost() -> None:
    async def work(pool: Pool) -> None:
        await ready(pool)
        asked = [asyncio.create_task(pool.do(job(say=k, sleep=0.05))) for k in range(30)]
        killed = set()
        for _ in range(3):
            await asyncio.sleep(0.15)
            if alive := {worker.process.pid for worker in pool._workers.values()} - killed:
                killed.add(min(alive))
                os.kill(min(alive), signal.SIGKILL)
        assert [(await each).head["said"] for each in asked] == list(range(30))
        await ready(pool)
        assert killed and pool.counts["replaced"] == len(killed)

    run(PoolLimits(workers=2, tries=5), work)


def test_what_a_worker_has_started_ends_with_it(tmp_path: Path) -> None:
    told = tmp_path / "child"

    async def work(pool: Pool) -> None:
        await ready(pool)
        with pytest.raises(DnnvssError):
            await pool.do(job(starts=str(told), sleep=30))

    run(PoolLimits(workers=1, working=0.5), work)
    child = Path(f"/proc/{told.read_text(encoding='utf-8')}/stat")
    until = time.monotonic() + 10
    while child.exists() and ") Z" not in child.read_text(encoding="utf-8") and time.monotonic() < until:
        time.sleep(0.02)
    assert not child.exists() or ") Z" in child.read_text(encoding="utf-8")


def test_a_job_that_ends_every_worker_is_refused() -> None:
    async def work(pool: Pool) -> None:
        with pytest.raises(BusyError, match="workers were lost over this"):
            await pool.do(job(die=1))
        assert (await pool.do(job(say=1))).head["said"] == 1

    run(PoolLimits(workers=1, tries=2), work)


def test_no_more_waits_than_is_allowed_and_who_is_refused_knows_for_how_long() -> None:
    async def work(pool: Pool) -> None:
        await ready(pool)
        await pool.do(job(sleep=0.2))
        asked = [asyncio.create_task(pool.do(job(say=k, sleep=0.2))) for k in range(9)]
        done = await asyncio.gather(*asked, return_exceptions=True)
        refused = [each for each in done if isinstance(each, BusyError)]
        assert len(refused) == 4 and pool.counts["refused"] == 4
        assert refused[0].seconds == 1  # four that wait, .2 s each
        assert sorted(each.head["said"] for each in done if isinstance(each, Done)) == [
            0,
            1,
            2,
            3,
            4,
        ]

    run(PoolLimits(workers=1, waiting=4), work)


def test_what_waits_or_works_too_long_is_told() -> None:
    async def work(pool: Pool) -> None:
        await ready(pool)
        long = asyncio.create_task(pool.do(job(sleep=30)))
        await asyncio.sleep(0)
        with pytest.raises(BusyError, match="waited too long"):
            await pool.do(job())
        with pytest.raises(DnnvssError, match=r"longer than 0.6 s"):
            await long
        await ready(pool)
        assert (await pool.do(job(say=1))).head["said"] == 1
        assert pool.counts["late"] == 1

    run(PoolLimits(workers=1, patience=0.3, working=0.6), work)


def test_who_leaves_the_queue_costs_nothing_and_who_leaves_the_work_little() -> None:
    async def work(pool: Pool) -> None:
        await ready(pool)
        begun = time.monotonic()
        at_work = asyncio.create_task(pool.do(job(sleep=30)))
        await asyncio.sleep(0.05)
        waiting = asyncio.create_task(pool.do(job(sleep=30)))
        await asyncio.sleep(0.05)
        waiting.cancel()
        at_work.cancel()
        assert (await pool.do(job(say=1))).head["said"] == 1
        assert time.monotonic() - begun < 10
        assert pool.counts["left"] == 1 and pool.inside == 0

    run(PoolLimits(workers=1, leaving=0.2), work)


def test_a_short_job_whose_listener_left_keeps_its_worker() -> None:
    async def work(pool: Pool) -> None:
        await ready(pool)
        first = process(await pool.do(job()))
        left = asyncio.create_task(pool.do(job(sleep=0.1)))
        await asyncio.sleep(0.02)
        left.cancel()
        assert process(await pool.do(job())) == first
        await asyncio.sleep(0.4)
        assert process(await pool.do(job())) == first

    run(PoolLimits(workers=1, leaving=0.3), work)


def test_who_knows_a_take_is_asked_first_and_another_one_where_that_takes_long() -> None:
    async def work(pool: Pool) -> None:
        await ready(pool)
        home = await pool.do(job())
        for _ in range(5):
            assert (await pool.do(job(), home.worker)).worker == home.worker
        busy = asyncio.create_task(pool.do(job(sleep=1.0), home.worker))
        await asyncio.sleep(0.02)
        other = await pool.do(job(), home.worker)
        assert other.worker != home.worker and other.waited > 0.4 and not busy.done()
        await busy
        assert (await pool.do(job(), 999)).head["kind"]  # one that is not there any more

    run(PoolLimits(workers=2), work)


def test_what_is_wrong_is_told_in_the_words_of_the_worker() -> None:
    async def work(pool: Pool) -> None:
        with pytest.raises(DnnvssError, match=r"is odd. Mend it\."):
            await pool.do(job(wrong="is odd"))
        with pytest.raises(RuntimeError):
            await pool.do(job(fail=1))
        assert (await pool.do(job(say=1))).head["said"] == 1
        assert pool.counts["replaced"] == 0

    run(PoolLimits(workers=1), work)


def test_workers_that_cannot_begin_are_tried_again_and_those_who_wait_are_told() -> None:
    async def work(pool: Pool) -> None:
        with pytest.raises(BusyError, match="waited too long"):
            await pool.do(job())
        assert pool.ready == 0 and pool.counts["replaced"] >= 1

    run(PoolLimits(workers=1, patience=0.6), work, broken=True)
