"""What motion capture, animators, recognisers and judges bring: a right file of each kind, and what reads it."""

import hashlib
import json
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from face.mesh_cases import tetrahedron, write_obj
from face.rig_cases import GROUPS, clips
from formats.test_formats_motion import c3d, markers
from formats.test_formats_timed_text import RECOGNISED, SRT, VTT
from viewing_cases import design, plain, sheet_of, simulated

from data_prep.session import _session_in
from dnnvss import files
from dnnvss.evaluation.outside.judged import MEASURES, ROWS, Judged
from dnnvss.evaluation.viewing.analysis import analyse
from dnnvss.evaluation.viewing.answers import answer_files, receive
from dnnvss.evaluation.viewing.report import html_page, markdown
from dnnvss.evaluation.viewing.run_scores import Seen, SeenBy, read_scores
from dnnvss.evaluation.viewing.sheet import Sheet
from dnnvss.export.take import Take, write_take
from dnnvss.export.take_read import read_take
from dnnvss.face.kinds import face_kind, load_face
from dnnvss.face.mesh import packaged_head
from dnnvss.face.mesh.gltf_read import read_gltf
from dnnvss.face.mesh.gltf_write import write_glb
from dnnvss.face.mesh.net import packaged_net
from dnnvss.face.mesh.obj import read_obj
from dnnvss.face.mesh.other import read_points
from dnnvss.face.mesh.transfer import find_points
from dnnvss.face.rig.code import RigCode
from dnnvss.face.rig.settings import RigSettings
from dnnvss.formats import Curves, in_order, read_curves, read_markers, read_timed_text, write_curves, write_trc
from dnnvss.runs.files import RunFiles
from dnnvss.studio.viewing import ViewingDesk
from dnnvss.timing import FrameClock

Reader = tuple[Path, Callable[[Path], Any]]


def motion(folder: Path) -> dict[str, Reader]:
    """Every kind by name."""
    return {**_tracked(folder / "motion"), **_meshes(folder / "meshes"), **_said(folder / "said"),
            **_taken(folder / "taken"), **_rig(folder / "rig"), **_judged(folder / "judged"),
            **_viewed(folder / "viewed")}


def _tracked(folder: Path) -> dict[str, Reader]:
    folder.mkdir()
    own = markers()
    names = [f"{name}_{axis}" for name in own.names for axis in "xyz"]
    flat = Curves(tuple(names), own.points.reshape(len(own.points), -1), np.arange(len(own.points)) / 120)
    live = "Timecode,BlendShapeCount,JawOpen,MouthClose\n" + "".join(
        f"12:00:{k // 5:02d}:{5 * (k % 5):02d}.250,2,0.{k}5,0.1\n" for k in range(9))
    made: dict[str, Reader] = {
        "trc": (write_trc(folder / "take.trc", own), read_markers),
        "markers csv": (write_curves(folder / "take.csv", flat), read_markers),
        "live link": (files.write_text(folder / "live.csv", live), read_curves),
    }
    try:
        made["c3d"] = c3d(folder / "take.c3d"), read_markers
    except BaseException as error:  # pytest's way to skip: the package that writes it is an extra
        if type(error).__name__ != "Skipped":
            raise
    return made


def _meshes(folder: Path) -> dict[str, Reader]:
    folder.mkdir()
    glb = write_glb(folder / "small.glb", tetrahedron(), np.zeros((3, 2)), np.arange(3) / 25)
    data = glb.read_bytes()
    length = int.from_bytes(data[12:16], "little")
    document = json.loads(data[20 : 20 + length])
    document["buffers"][0]["uri"] = "small.bin"
    (folder / "small.bin").write_bytes(data[28 + length :])
    return {
        "obj": (write_obj(folder / "small.obj", tetrahedron()), read_obj),
        "glb": (glb, read_gltf),
        "gltf": (files.write_json(folder / "small.gltf", document), read_gltf),
        "gltf bytes": (folder / "small.bin", lambda _: read_gltf(folder / "small.gltf")),
    }


def _taken(folder: Path) -> dict[str, Reader]:
    """A take as we write it, points of a head by name, a session of the built-in talker, viewers' scores of a run."""
    folder.mkdir()
    head, net = packaged_head(), packaged_net()
    named = {name: int(v) if k % 2 else head.mesh.vertices[v].tolist()
             for k, (name, v) in enumerate(zip(net.names[:12], net.vertices[:12], strict=True))}
    take = Take({"jawOpen": np.linspace(0, 1, 9), "mouthClose": np.zeros(9)}, FrameClock(30))
    session = {"version": 2, "form": "curves", "sentences": 3, "held_out": 1, "seed": 0, "whole": True}
    seen = SeenBy((Seen("a", "which?", "score", 3, digest=hashlib.sha256(b"learnt").hexdigest()[:16]),), ("b",))
    files.write_text(RunFiles(folder / "run").model, "learnt")
    return {
        "take json": (write_take(folder / "take.json", take), read_take),
        "head points": (files.write_json(folder / "points.json", named),
                        lambda path: find_points(head.mesh, read_points(path, head.mesh))),
        "session json": (files.write_json(folder / "session/session.json", session),
                         lambda path: _session_in(path.parent)),
        "run scores": (files.write_json(RunFiles(folder / "run").viewing, asdict(seen)),
                       lambda path: read_scores(path.parent)),
    }


def _said(folder: Path) -> dict[str, Reader]:
    def read(path: Path) -> Any:
        return in_order(read_timed_text(path))

    recognised = {f"heard by {name}": (files.write_json(folder / f"{name}.json", value), read)
                  for name, value in RECOGNISED.items()}
    return {"srt": (files.write_text(folder / "a.srt", SRT), read),
            "vtt": (files.write_text(folder / "a.vtt", VTT), read), **recognised}


def _rig(folder: Path) -> dict[str, Reader]:
    kind = face_kind("rig")
    face = kind.fit(clips(3), GROUPS, RigSettings(), progress=False)
    code = kind.encode(face, clips(1)[0]).code

    def used(path: Path) -> Any:
        own = load_face(path)
        return own.gauges, own.groups, own.points(np.zeros((2, len(own.names))))

    return {"rig face": (face.save(folder / "rig.npz"), used),
            "rig code": (code.save(folder / "rig_code.npz"), RigCode.load)}


def _judged(folder: Path) -> dict[str, Reader]:
    pairs = {row: dict.fromkeys(MEASURES, ((0.5, 1.0), (0.25, 2.0))) for row in ROWS}
    path = Judged(("a", "b"), "articulated", pairs).save(folder).with_suffix(".json")
    return {"judged": (path, lambda _: Judged.load(folder).markdown())}  # type: ignore[union-attr]


def _viewed(folder: Path) -> dict[str, Reader]:
    """A viewing test, an answer to it, and what viewers gave a run."""
    found: dict[str, Reader] = {}
    for kind in ("preference", "single"):
        sheet = sheet_of(design(kind, sentences=6, per_viewer=6))
        home = sheet.save(folder / kind).parent
        for stimulus in sheet.stimuli:
            files.write_text(home / "page" / "stimuli" / f"{stimulus.id}.mp4", "")
        even = {condition.name: 0.0 for condition in sheet.conditions}
        answers = [files.write_json(home / "answers" / f"{n}.json", plain(simulated(sheet, n, even)))
                   for n in range(7)]

        def used(_: Path, home: Path = home) -> Any:
            opened = Sheet.open(home)
            result = analyse(opened, receive(opened, answer_files(home / "answers")))
            return html_page(result), markdown(result), ViewingDesk(home).place({"viewer": "0" * 32}), opened.public()

        found |= {f"viewing test {kind}": (home / "key.json", used), f"answer {kind}": (answers[3], used)}
    return found
