"""What the service is asked for: bodies, their description, and the bounds on work."""

import threading
import time
from pathlib import Path

import pytest

from dnnvss.errors import DnnvssError
from dnnvss.records import as_record
from dnnvss.studio.page import BusyError
from dnnvss.studio.speaking import Change, Saying, SpeakingDesk
from dnnvss.studio.speaking.openapi import described
from dnnvss.studio.speaking.uploads import Uploads
from dnnvss.studio.speaking.work import Work


def asked(**body: object) -> Saying:
    return as_record(Saying, {"run": "r", **body}, "the request", "")


def test_a_body_has_the_names_of_the_settings() -> None:
    saying = asked(text="hello", speed=1.2, keys=[{"time": 1, "name": "aperture", "low": 3}])
    key = saying.keys[0].key()
    assert (saying.text, saying.speed, key.low, key.high) == ("hello", 1.2, 3.0, float("inf"))


@pytest.mark.parametrize("body", [
    {"speed": 0}, {"speed": float("nan")}, {"speed": "fast"}, {"engine": "siri"}, {"text": 3}, {"text": "a" * 20_001},
    {"keys": [{"time": -1, "name": "a"}]}, {"keys": "all"}, {"unknown": 1}, {"articulation": 99},
    {"keys": [{"time": 1, "name": "a"}] * 5001}, {"alignment": [1, 2]}, {"pronunciations": {"a": 3}}])
def test_other_bodies_are_refused(body: dict[str, object]) -> None:
    with pytest.raises(DnnvssError):
        asked(**body)


def test_the_description_names_every_route_and_setting(tmp_path: Path) -> None:
    desk = SpeakingDesk(tmp_path, {})
    try:
        routes = desk.page().routes
        told = described(routes)
        assert set(told["paths"]) == {route.path for route in routes}
        schema = told["paths"]["/v1/speak"]["post"]["requestBody"]["content"]["application/json"]["schema"]
        assert schema["required"] == ["run"]
        assert schema["properties"]["speed"] == {"type": "number", "minimum": 0.2, "maximum": 5,
                                                 "description": "against the talker's"}
        assert set(told["paths"]["/v1/takes/{take}"]["post"]["requestBody"]["content"]["application/json"]["schema"]
                   ["properties"]) == set(Change.__dataclass_fields__)
        assert desk.runs()["runs"] == []
    finally:
        desk.close()


def test_no_more_is_done_at_once_and_no_more_waits_than_is_allowed() -> None:
    work, together, most = Work(at_once=2, waiting=2, patience=5), [], []

    def do() -> None:
        try:
            with work.task("t"):
                together.append(1)
                most.append(len(together))
                time.sleep(0.1)
                together.pop()
        except BusyError:
            most.append(-1)

    threads = [threading.Thread(target=do) for _ in range(7)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(most) == [-1, -1, -1, *sorted(n for n in most if n > 0)]
    assert max(most) <= 2
    assert work.inside == 0
    assert 'dnnvss_work_total{task="t"} 4' in work.told()
    assert 'dnnvss_work_total{task="refused"} 3' in work.told()


def test_what_waits_too_long_is_told() -> None:
    work = Work(at_once=1, waiting=5, patience=0.05)
    with work.task("long"), pytest.raises(BusyError, match="too long"), work.task("short"):
        pass
    assert work.inside == 0


def test_what_is_brought_and_cannot_be_read_is_told_in_words() -> None:
    uploads = Uploads()
    with pytest.raises(DnnvssError, match="cannot be read"):
        uploads.sound(b"RIFF\0\0")
    with pytest.raises(DnnvssError, match="not read"):
        uploads.alignment("a.exe", b"")
    with pytest.raises(DnnvssError, match="not kept"):
        uploads.get("nothing")
