"""Hostile runs, bundles, corpora and labels, each opened by the real commands in a process that is watched.

    python tests/hostile.py FOLDER     one line of JSON a case

Each case runs in a fork of this process with an audit hook of Python's, which notes what no file may bring about:
programs and connections that are started, code and globals that are loaded by name, files written outside the folder of
the case, and files read in the folder of secrets.
"""

import argparse
import io
import json
import os
import pickle
import re
import resource
import shutil
import sys
import tempfile
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import kills
import numpy as np

SECRET = "hunter2-of-nobody"
STARTED = ("os.system", "os.exec", "os.posix_spawn", "os.spawn", "pty.spawn", "subprocess.Popen", "socket.connect",
           "ctypes.dlopen")
HARMLESS = ("numpy", "torch", "collections", "_codecs")
"""Packages whose globals a safe unpickler may look up."""


@dataclass(frozen=True)
class Place:
    """Where a case is played.

    Args:
        home: the folder of the case, with ``runs/a`` and ``data``; commands may write here.
        secret: a folder that none may read or write.
    """

    home: Path
    secret: Path

    @property
    def run(self) -> Path:
        """The run folder that is made hostile."""
        return self.home / "runs" / "a"

    @property
    def data(self) -> Path:
        """The corpus that is made hostile."""
        return self.home / "data"

    @property
    def command(self) -> str:
        """What hostile code would do: it leaves a file among the secrets."""
        return f"touch {self.secret}/executed"


class Evil:
    """An object whose unpickling runs a program."""

    def __init__(self, command: str) -> None:
        self.command = command

    def __reduce__(self) -> tuple[Any, ...]:
        return os.system, (self.command,)


Case = tuple[Callable[[Place], None], Callable[[Place], tuple[object, ...]]]


def speak(place: Place) -> tuple[object, ...]:
    """The command that speaks with the run."""
    return ("speak", f"run={place.run}", "text=hello", f"out={place.home}/o/hello.mp4", "speech=formant")


def bundled(place: Place) -> tuple[object, ...]:
    """The command that speaks with the bundle."""
    return ("speak", f"run={place.home}/bundle", "text=hello", f"out={place.home}/o/hello.mp4", "speech=formant")


def export(place: Place) -> tuple[object, ...]:
    """The command that exports the run."""
    return ("export", place.run, "--out", place.home / "out", "--network", "npz")


def compare(place: Place) -> tuple[object, ...]:
    """The command that compares the run."""
    return ("compare", place.run, "--out", place.home / "table")


def train(place: Place) -> tuple[object, ...]:
    """The command that trains on the corpus."""
    return ("train", "corpus=demo", f"corpus.out={place.data}", f"runs={place.home}/runs", f"run={place.home}/runs/b",
            *kills.FAST)


def resume(place: Place) -> tuple[object, ...]:
    """The command that goes on with the run."""
    return ("train", "corpus=demo", f"corpus.out={place.data}", f"runs={place.home}/runs", f"run={place.run}",
            *kills.FAST)


def check(place: Place) -> tuple[object, ...]:
    """The command that looks at the labels."""
    return ("label", "check", place.home / "labels")


def page(place: Place) -> tuple[object, ...]:
    """The command that serves the labels; the watcher asks for everything that they name."""
    return ("label", "page", place.home / "labels", "--port", 0)


def _config(change: Callable[[dict[str, Any], Place], None]) -> Callable[[Place], None]:
    def make(place: Place) -> None:
        import yaml

        path = place.run / "config.yaml"
        values = yaml.safe_load(path.read_text())
        change(values, place)
        path.write_text(yaml.safe_dump(values))
    return make


def _text(name: str, change: Callable[[str, Place], str]) -> Callable[[Place], None]:
    def make(place: Place) -> None:
        path = place.home / name
        path.write_text(change(path.read_text(), place))
    return make


def _target(value: dict[str, Any], place: Place) -> None:
    value["model"]["network"]["activation"] = {"_target_": "sympy.parsing.sympy_parser.eval_expr", "_args_": [
        f"__import__('os').system('{place.command}')"]}


def _targets_everywhere(value: dict[str, Any], place: Place) -> None:
    for group in ("model", "face", "labels", "style", "trainer", "trajectory"):
        value[group]["_target_"] = "os.system"
        value[group]["_args_"] = [place.command]


def _system(value: dict[str, Any], place: Place) -> None:
    value["model"]["system"] = "os.system"
    value["model"]["command"] = place.command


def _pickled(name: str) -> Callable[[Place], None]:
    """A file that is a bare pickle."""
    return lambda place: ((place.home / name).parent.mkdir(parents=True, exist_ok=True),
                          (place.home / name).write_bytes(pickle.dumps(Evil(place.command))))[-1] and None


def _torch(name: str) -> Callable[[Place], None]:
    """An archive of torch's whose pickle is another."""
    def make(place: Place) -> None:
        path = place.home / name
        whole = io.BytesIO()
        with zipfile.ZipFile(path) as old, zipfile.ZipFile(whole, "w", zipfile.ZIP_STORED) as new:
            for member in old.infolist():
                evil = member.filename.endswith("data.pkl")
                new.writestr(member.filename, pickle.dumps(Evil(place.command), 2) if evil else old.read(member))
        path.write_bytes(whole.getvalue())
    return make


def _objects(name: str) -> Callable[[Place], None]:
    """An ``.npz`` all of whose arrays are objects."""
    def make(place: Place) -> None:
        path = place.home / name
        with np.load(path) as archive:
            names = archive.files
        evil = np.array([Evil(place.command)], dtype=object)
        np.savez(path, **dict.fromkeys(names, evil))
    return make


def _bomb(name: str, claim: bool = False) -> Callable[[Place], None]:
    """An ``.npz`` or checkpoint that opens to two gigabytes, or an array that claims a thousand."""
    def make(place: Place) -> None:
        path = place.home / name
        with zipfile.ZipFile(path) as old:
            members = {m.filename: old.read(m) for m in old.infolist()}
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as new:
            for number, (member, data) in enumerate(members.items()):
                if number and not member.endswith("data.pkl"):
                    new.writestr(member, data)
                    continue
                head = io.BytesIO()
                np.lib.format.write_array_header_1_0(head, {"descr": "<f4", "fortran_order": False,
                                                            "shape": (250 * 10**9,) if claim else (94 * 2**22,)})
                with new.open(member, "w") as stream:
                    stream.write(head.getvalue())
                    for _ in range(0 if claim else 94):
                        stream.write(bytes(2**24))
    return make


def _link(name: str, target: str) -> Callable[[Place], None]:
    """A file that is a link to a secret."""
    def make(place: Place) -> None:
        path = place.home / name
        path.unlink(missing_ok=True)
        path.symlink_to(place.secret / target)
    return make


def _bundle(change: Callable[[Place, dict[str, Any]], None]) -> Callable[[Place], None]:
    """A bundle of the run, whose index, digests right, is then changed."""
    def make(place: Place) -> None:
        from dnnvss.files import digest
        from dnnvss.runs.bundling import write_bundle
        from dnnvss.runs.run import Run

        folder = write_bundle(Run.open(place.run), place.home / "bundle", "model.npz")
        index = json.loads((folder / "bundle.json").read_text())
        change(place, index)
        for name in index["digests"]:
            path = folder / name
            if path.is_file() and index.get("honest", True):
                index["digests"][name] = digest(path)
        index.pop("honest", None)
        (folder / "bundle.json").write_text(json.dumps(index))
    return make


def _program(place: Place, index: dict[str, Any]) -> None:
    """A ``.pt2`` with a pickle in it, as the network."""
    with zipfile.ZipFile(place.home / "bundle" / "model.pt2", "w") as archive:
        for name in ("archive_format", "models/model.json", "data/sample_inputs/model.pt", "data/weights/model.pt"):
            archive.writestr(f"model/{name}", pickle.dumps(Evil(place.command)))
    index["network"] = "model.pt2"
    index["digests"]["model.pt2"] = index["digests"].pop("model.npz")


def _external(place: Place, index: dict[str, Any]) -> None:
    """An ONNX file that keeps its numbers among the secrets."""
    location = str(place.secret / "password").encode()

    def field(number: int, value: bytes) -> bytes:
        return bytes([number << 3 | 2, len(value)]) + value

    entry = field(13, field(1, b"location") + field(2, location))
    tensor = field(8, b"w") + entry + bytes([14 << 3, 1])
    (place.home / "bundle" / "model.onnx").write_bytes(field(7, field(5, tensor)))
    index["network"] = "model.onnx"
    index["digests"]["model.onnx"] = index["digests"].pop("model.npz")


def _set(key: str, value: Callable[[Place], Any]) -> Callable[[Place, dict[str, Any]], None]:
    return lambda place, index: index.update({key: value(place)})


def _swapped(place: Place, index: dict[str, Any]) -> None:
    """Weights that are not those of the index."""
    index["honest"] = False
    path = place.home / "bundle" / "model.npz"
    path.write_bytes(path.read_bytes()[:-1] + b"x")


def _utterance(field: str, value: Callable[[Place], str]) -> Callable[[Place], None]:
    def make(place: Place) -> None:
        path = place.data / "utterances.jsonl"
        rows = [json.loads(line) for line in path.read_text().splitlines()]
        for row in rows:
            row[field] = value(place)
        path.write_text("\n".join(map(json.dumps, rows)) + "\n")
        shutil.rmtree(place.data / "face", ignore_errors=True)
    return make


def _videos(make: Callable[[Place, Path], None]) -> Callable[[Place], None]:
    def each(place: Place) -> None:
        shutil.rmtree(place.data / "face", ignore_errors=True)
        for path in (place.data / "video").iterdir():
            path.unlink()
            make(place, path)
    return each


def _playlist(place: Place, path: Path) -> None:
    shutil.copyfile(place.secret / "film.mp4", path.parent.parent / "outside.mp4")
    path.write_text("ffconcat version 1.0\nfile ../outside.mp4\n")


def _cache(make: Callable[[str], Callable[[Place], None]]) -> Callable[[Place], None]:
    """A hostile face kept with the corpus."""
    def each(place: Place) -> None:
        for path in (place.data / "face").rglob("*.npz"):
            make(str(path.relative_to(place.home)))(place)
    return each


def _labels(image: Callable[[Place], str], points: Callable[[Place], str]) -> Callable[[Place], None]:
    def make(place: Place) -> None:
        folder = place.home / "labels"
        folder.mkdir()
        (folder / "out").symlink_to(place.secret)
        (folder / "b.png").symlink_to(place.secret / "password")
        (folder / "b.pts").symlink_to(place.secret / "points")
        (folder / "labels.json").write_text(json.dumps({
            "scheme": "", "videos": str(place.secret), "groups": {"lips_outer": [0, 2]}, "done": [],
            "labels": [{"video": "v.mp4", "frame": 0, "image": image(place), "points": points(place)}]}))
    return make


def _older(make: Callable[[Place], None]) -> Callable[[Place], None]:
    """The same in a run whose system lies in the file of older runs."""
    def both(place: Place) -> None:
        from dnnvss.training.checkpoints import load_checkpoint, save_checkpoint

        kept = place.run / "model.npz"
        save_checkpoint(place.run / "model.pt", load_checkpoint(kept))
        kept.unlink()
        make(place)
    return both


def _laughs(text: str, place: Place) -> str:
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 9)}]" for k in range(1, 12)]
    return "\n".join([*lines, text])


_CONFIG = "runs/a/config.yaml"
CASES: dict[str, Case] = {
    "run: a nested _target_ through an innocent library": (_config(_target), speak),
    "run: a _target_ in every group": (_config(_targets_everywhere), export),
    "run: a system named as a function": (_config(_system), speak),
    "run: a YAML tag that applies a function": (
        _text(_CONFIG, lambda t, p: f"{t}more: !!python/object/apply:os.system ['{p.command}']\n"), speak),
    "run: YAML that grows without end": (_text(_CONFIG, _laughs), export),
    "run: a setting that looks up the environment": (_config(
        lambda v, p: v["labels"].update(name="${oc.env:DNNVSS_SECRET}", blocks=["${oc.env:DNNVSS_SECRET}"])), speak),
    "run: a corpus among the secrets": (_config(lambda v, p: v["corpus"].update(out=str(p.secret))), compare),
    "run: model.npz of objects": (_objects("runs/a/model.npz"), speak),
    "run: model.npz opens to gigabytes": (_bomb("runs/a/model.npz"), speak),
    "older run: model.pt is a bare pickle": (_older(_pickled("runs/a/model.pt")), speak),
    "older run: model.pt with another pickle": (_older(_torch("runs/a/model.pt")), export),
    "older run: model.pt opens to gigabytes": (_older(_bomb("runs/a/model.pt")), speak),
    "run: face.npz of objects": (_objects("runs/a/face.npz"), speak),
    "run: talker.npz of objects": (_objects("runs/a/talker.npz"), speak),
    "run: durations.npz of objects": (_objects("runs/a/durations.npz"), speak),
    "run: neutral.npz of objects": (_objects("runs/a/neutral.npz"), speak),
    "run: face.npz opens to gigabytes": (_bomb("runs/a/face.npz"), speak),
    "run: an array that claims a thousand gigabytes": (_bomb("runs/a/talker.npz", claim=True), speak),
    "run: voice.json is a link to a secret": (_link("runs/a/voice.json", "password"), speak),
    "run: predictions of objects": (_objects("runs/a/predictions/reference.npz"), compare),
    "run: a checkpoint that is a pickle": (
        lambda p: (_pickled("runs/a/checkpoints/last.ckpt")(p), _pickled("runs/a/checkpoints/best.ckpt")(p),
                   (p.run / "model.npz").unlink(), (p.run / "metrics.json").unlink())[-1], resume),
    "bundle: the network above the folder": (_bundle(_set("network", lambda p: "../runs/a/model.npz")), bundled),
    "bundle: the network by an absolute name": (_bundle(_set("network", lambda p: f"{p.secret}/model.onnx")), bundled),
    "bundle: digests that lead out": (
        _bundle(lambda p, i: i["digests"].update({"../../secret/password": "0"})), bundled),
    "bundle: a .pt2 with pickles": (_bundle(_program), bundled),
    "bundle: ONNX with its numbers among the secrets": (_bundle(_external), bundled),
    "bundle: weights that were exchanged": (_bundle(_swapped), bundled),
    "bundle: a member that is a link": (
        lambda p: (_bundle(lambda _, i: None)(p), _link("bundle/face.npz", "password")(p))[-1], bundled),
    "corpus: ids that lead out": (_utterance("id", lambda p: "../../secret/escaped"), train),
    "corpus: videos by absolute names": (_utterance("video", lambda p: f"{p.secret}/film.mp4"), train),
    "corpus: videos that are links": (_videos(lambda p, path: path.symlink_to(p.secret / "film.mp4")), train),
    "corpus: videos that are playlists": (_videos(_playlist), train),
    "corpus: landmarks of objects": (
        lambda p: [_objects(str(x.relative_to(p.home)))(p) for x in (p.data / "landmarks").iterdir()] and
        shutil.rmtree(p.data / "face"), train),
    "corpus: a face of objects kept with it": (_cache(_objects), train),
    "corpus: a split that is a link": (_link("data/splits/train.txt", "password"), train),
    "labels: names that lead out": (_labels(lambda p: "../secret/password", lambda p: "../secret/points"), check),
    "labels: absolute names": (_labels(lambda p: f"{p.secret}/password.png", lambda p: f"{p.secret}/a.pts"), page),
    "labels: a picture that is a link": (_labels(lambda p: "b.png", lambda p: "b.pts"), page),
    "labels: a folder that is a link": (_labels(lambda p: "out/film.png", lambda p: "out/a.pts"), page),
    "labels: points over another file": (_labels(lambda p: "c.png", lambda p: "labels.json"), check),
}


class Watch:
    """Notes what happens in this process that no file may bring about."""

    def __init__(self, place: Place) -> None:
        self.place, self.seen = place, list[str]()
        self.written = (place.home, Path(tempfile.gettempdir()), Path("/dev"), Path("/proc"))

    def __call__(self, event: str, given: tuple[Any, ...]) -> None:
        """Look at an event of Python's auditing."""
        if event == "socket.connect" and given[1][0] == "127.0.0.1":
            return  # what asks the page of the labels
        if event in STARTED and not (event == "ctypes.dlopen" and self._known(given[0])):
            self.seen.append(f"{event} {given[:2]}")
        elif event == "pickle.find_class" and str(given[0]).partition(".")[0] not in HARMLESS:
            self.seen.append(f"{event} {given}")
        elif event == "exec" and not self._known(given[0].co_filename):
            self.seen.append(f"{event} {given[0].co_filename}")
        elif event == "open" and isinstance(given[0], str | bytes):
            self._opened(Path(os.path.realpath(os.fsdecode(given[0]))), int(given[2] or 0))
        elif event in ("os.rename", "os.remove", "os.mkdir", "os.link", "os.symlink"):
            for path in (Path(os.path.realpath(os.fsdecode(p))) for p in given[:2] if isinstance(p, str | bytes)):
                if event != "os.mkdir" or not path.is_dir():  # a folder that is there already stays as it is
                    self._written(path)

    @staticmethod
    def _known(name: object) -> bool:
        """Whether code or a library is of Python, a package or this repository, or made by them as they run."""
        text = str(name)
        roots = (sys.prefix, sys.base_prefix, str(kills.ROOT), "<", "/lib", "/usr/lib")
        return name is None or text.startswith(roots) or "/" not in text

    def _opened(self, path: Path, flags: int) -> None:
        if path.is_relative_to(self.place.secret):
            self.seen.append(f"open {path}")
        elif flags & (os.O_WRONLY | os.O_RDWR | os.O_CREAT):
            self._written(path)

    def _written(self, path: Path) -> None:
        if path.is_relative_to(self.place.secret) or not any(map(path.is_relative_to, self.written)):
            self.seen.append(f"write {path}")


def play(folder: Path, name: str) -> dict[str, Any]:
    """Play a case in a fork; return what it ended with, what it said and what was seen."""
    home, secret, told = folder / "home", folder / "secret", folder / "told.json"
    kills.fresh(home, folder / "made", ("data", "runs"), whole=True)
    shutil.rmtree(secret, ignore_errors=True)
    secret.mkdir()
    (secret / "password").write_text(f"{SECRET}\n")
    (secret / "points").write_text("1 2\n3 4\n")
    shutil.copyfile(next((folder / "made/data/video").iterdir()), secret / "film.mp4")
    place = Place(home, secret)
    before = kills.state(secret)
    make, words = CASES[name]
    make(place)
    log = folder / "log"
    log.write_text("")
    watch = Watch(place)

    def prepare() -> None:
        os.environ["DNNVSS_SECRET"] = SECRET
        _ask_everything(place)
        sys.addaudithook(watch)

    def finish() -> None:
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**10
        seen = list(watch.seen)
        told.write_text(json.dumps({"seen": seen, "peak": peak}))

    told.unlink(missing_ok=True)
    status = kills.run(words(place), log, prepare=prepare, finish=finish)
    said = log.read_text(errors="replace")
    found = json.loads(told.read_text()) if told.is_file() else {"seen": ["it was killed"], "peak": 0}
    changed = kills.state(secret) != before
    lines = [line for line in re.split(r"[\r\n]", said) if line.startswith("error: ")]
    return {"case": name, "status": status, "errors": lines, "changed": changed, "secret": SECRET in said,
            "traceback": "Traceback" in said, "said": said[-1500:], **found}


def _ask_everything(place: Place) -> None:
    """Let a page that is served be asked for all that its labels name, and for points to be kept, and then end."""
    from http.client import HTTPConnection
    from urllib.parse import quote

    from dnnvss.studio.server import Server

    def wait(self: Server) -> None:
        port = int(self.url.rstrip("/").rpartition(":")[2])
        label = json.loads((place.home / "labels/labels.json").read_text())["labels"][0]
        image = quote(label["image"], safe="")
        bad = []
        body = json.dumps({"points": [[1, 2], [3, 4]], "done": True})
        for method, path in (("GET", f"/image/{image}"), ("GET", f"/points/{image}"), ("POST", f"/points/{image}")):
            connection = HTTPConnection("127.0.0.1", port, timeout=20)
            sent = {"Content-Type": "application/json"} if method == "POST" else {}
            connection.request(method, path, body if method == "POST" else None, sent)
            answer = connection.getresponse()
            print(method, path, answer.status, answer.read().decode(errors="replace"))
            bad.append(answer.status)
            connection.close()
        if min(bad) >= 400:
            print(f"\nerror: the page answered {bad}")
        raise SystemExit(1)

    Server.wait = wait


def main() -> int:
    """Play all cases, or those whose names hold a word."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", default="")
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    folder = options.folder.resolve()
    kills.load()
    kills.made(folder)
    for name in CASES:
        if options.only in name:
            print(json.dumps(play(folder, name)), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
