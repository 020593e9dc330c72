"""What the service is asked for: bodies, their description, and the bounds on work."""

import asyncio
import io
import json
import threading
from pathlib import Path

import numpy as np
import pytest
import scipy.io.wavfile

from dnnvss.commands.studio import _token, main
from dnnvss.errors import DnnvssError
from dnnvss.records import as_record
from dnnvss.runs.files import RunFiles
from dnnvss.studio.page import Seen
from dnnvss.studio.requests import Requests
from dnnvss.studio.speaking import Change, Saying, SpeakingDesk
from dnnvss.studio.speaking.known import KnownTakes
from dnnvss.studio.speaking.latest import Latest
from dnnvss.studio.speaking.openapi import described
from dnnvss.studio.speaking.uploads import Uploads


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
        assert schema["properties"]["speed"] == {"type": "number", "minimum": 0.25, "maximum": 4,
                                                 "description": "against the talker's"}
        assert set(told["paths"]["/v1/takes/{take}"]["post"]["requestBody"]["content"]["application/json"]["schema"]
                   ["properties"]) == set(Change.__dataclass_fields__)
        assert desk.runs()["runs"] == []
    finally:
        desk.close()


def test_what_is_brought_and_cannot_be_read_is_told_in_words(tmp_path: Path) -> None:
    uploads = Uploads(tmp_path)
    with pytest.raises(DnnvssError, match="cannot be read"):
        asyncio.run(uploads.sound(b"RIFF\0\0"))
    with pytest.raises(DnnvssError, match="not read"):
        asyncio.run(uploads.alignment("a.exe", b""))
    with pytest.raises(DnnvssError, match="not kept"):
        uploads.path("nothing")


@pytest.mark.parametrize("speed", [0.24, 4.01])
def test_a_speed_that_no_sentence_is_said_at_is_refused_before_it_is_said(speed: float) -> None:
    with pytest.raises(DnnvssError, match="speed="):
        asked(text="hello", speed=speed)


def test_a_run_in_place_of_the_folder_that_holds_it_is_told(tmp_path: Path) -> None:
    (run := tmp_path / "runs" / "one").mkdir(parents=True)
    RunFiles(run).config.touch()
    with pytest.raises(DnnvssError, match=f"is a run itself.*dnnvss studio {run.parent}"):
        main([str(run)])
    with pytest.raises(DnnvssError, match="is no folder of runs"):
        main([str(RunFiles(run).config)])


def test_who_leaves_ends_the_process_that_reads_what_was_brought(tmp_path: Path) -> None:
    children = Path(f"/proc/self/task/{threading.get_native_id()}/children")

    async def left() -> None:
        before = set(children.read_text().split())
        reading = asyncio.create_task(Uploads(tmp_path).sound(_silence(seconds=120)))
        while not (begun := set(children.read_text().split()) - before):
            await asyncio.sleep(0.01)
        reading.cancel()
        with pytest.raises(asyncio.CancelledError):
            await reading
        assert not begun & set(children.read_text().split())

    asyncio.run(left())
    assert not list(tmp_path.iterdir())


def _silence(seconds: int) -> bytes:
    file = io.BytesIO()
    scipy.io.wavfile.write(file, 44100, np.zeros(44100 * seconds, dtype=np.int16))
    return file.getvalue()


def test_the_latest_stay_and_who_asks_keeps_a_thing() -> None:
    kept = Latest[str](most=3, size_most=100)
    assert [kept.put(name, name.upper(), 40) for name in ("a", "b")] == [[], []]
    assert kept.get("a") == "A" and kept.put("c", "C", 20) == [] and kept.put("d", "D", 10) == ["b"]
    assert kept.put("e", "E", 200) == ["a", "c", "d"] and kept.items() == [("e", "E")] and kept.get("b") is None


def test_a_token_is_given_or_made_and_none_is_short(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DNNVSS_TOKEN", "sixteen-letters!")
    assert _token("0.0.0.0") == ("sixteen-letters!", False)
    made, new = _token("0.0.0.0")
    assert new and made is not None and len(made) >= 16
    assert _token("127.0.0.1") == (None, False)
    monkeypatch.setenv("DNNVSS_TOKEN", "short")
    with pytest.raises(DnnvssError, match="shorter than 16"):
        _token("0.0.0.0")


def test_old_takes_are_forgotten_with_their_files(tmp_path: Path) -> None:
    known = KnownTakes(tmp_path, most=3, files_most=250)
    for k in range(4):
        (tmp_path / f"t{k}").mkdir()
        (tmp_path / f"t{k}" / "a.csv").write_bytes(bytes(100))
        known.put(f"t{k}", asked(text=f"{k}"), k)
    with pytest.raises(DnnvssError, match="not kept"):
        known.get("t0")
    assert not (tmp_path / "t0").exists() and known.get("t1").saying.text == "1"
    for k in (2, 3, 1):  # 300 bytes, and 250 are kept: the files of the one asked for longest ago go
        known.file(f"t{k}", "a.csv")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["t1", "t3"] and len(known) == 3


def test_long_sayings_make_room_for_each_other(tmp_path: Path) -> None:
    known = KnownTakes(tmp_path, bytes_most=3000)
    for k in range(4):
        known.put(f"t{k}", asked(text="a" * 1000), 1)
    assert len(known) == 2 and known.get("t3").told["text"] == "a" * 1000


def test_requests_are_counted_and_written_of_without_what_was_said(tmp_path: Path) -> None:
    log = tmp_path / "log.jsonl"
    quiet, told = Requests(log), Requests()
    for status, seconds in ((200, 0.04), (200, 0.4), (503, 40.0)):
        quiet.seen(Seen("POST", "/v1/speak", status, seconds, 10, 20, {"signs": 5, **quiet.texts("hello")}))
    quiet.close()
    lines = [json.loads(line) for line in log.read_text().splitlines()]
    assert [line["status"] for line in lines] == [200, 200, 503] and lines[1]["seconds"] == 0.4
    assert "hello" not in log.read_text() and lines[0]["signs"] == 5
    text = quiet.told()
    assert 'dnnvss_requests_total{method="POST",route="/v1/speak",status="200"} 2' in text
    assert 'dnnvss_request_seconds_bucket{route="/v1/speak",le="0.5"} 2' in text
    assert 'dnnvss_request_seconds_bucket{route="/v1/speak",le="+Inf"} 3' in text
    assert told.texts("hello") == {} and Requests(texts=True).texts("hello") == {"text": "hello"}
