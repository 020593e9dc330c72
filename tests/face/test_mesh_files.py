"""Meshes from files and into them."""

import base64
import json
import os
import shutil
import struct
import subprocess

import numpy as np
import pytest
from face.mesh_cases import swing, tetrahedron, write_obj
from scipy.spatial import cKDTree

from dnnvss.errors import DnnvssError
from dnnvss.face.mesh import packaged_head
from dnnvss.face.mesh.gltf_read import read_gltf
from dnnvss.face.mesh.gltf_write import write_glb
from dnnvss.face.mesh.obj import read_obj

HEAD = packaged_head()


def parted(data: bytes) -> tuple[dict, bytes]:
    """Document and binary chunk of a .glb file."""
    length = struct.unpack_from("<I", data, 12)[0]
    return json.loads(data[20 : 20 + length]), data[28 + length :]


def as_gltf(path, document, uri):
    """A .gltf file of a document, its bytes elsewhere."""
    document["buffers"][0]["uri"] = uri
    path.write_text(json.dumps(document))
    return path


@pytest.fixture(scope="module")
def glb(tmp_path_factory):
    path = tmp_path_factory.mktemp("glb") / "head.glb"
    weights = swing(20, "jawOpen", "mouthPucker")
    return write_glb(path, HEAD, weights, np.arange(20) / 25, {"timecode": "00:00:00:00"})


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    return write_glb(tmp_path_factory.mktemp("small") / "small.glb", tetrahedron())


def test_an_obj_comes_back(tmp_path):
    read = read_obj(write_obj(tmp_path / "head.obj", HEAD))
    np.testing.assert_allclose(read.mesh.vertices, HEAD.mesh.vertices, atol=1e-9)
    assert set(read.mesh.parts) == set(HEAD.mesh.parts)
    for name in HEAD.mesh.parts:
        np.testing.assert_array_equal(read.mesh.of_part(name), HEAD.mesh.of_part(name))


def test_faces_of_five_corners_and_numbers_from_the_end(tmp_path):
    path = tmp_path / "a.obj"
    path.write_text(
        "v 0 0 0\nv 1 0 0\nv 1 1 0 1.0\nv .5 2 0\nv 0 1 0\nvn 0 0 1\ng teeth_lower\nf -5 -4 -3 -2 -1\n"
    )
    mesh = read_obj(path).mesh
    np.testing.assert_array_equal(mesh.faces, [[0, 1, 2, 2], [0, 2, 3, 3], [0, 3, 4, 4]])
    assert mesh.parts == ("lower_teeth",)


@pytest.mark.parametrize(
    "text",
    [
        "f 1 2 3\n",
        "v 0 0\n",
        "v a b c\n",
        "v 0 0 0\nf 1 1\n",
        "v 0 0 0\nf 0 1 1\n",
        "v 0 0 0\nf 1 1 1e3\n",
        "",
        "v nan 0 0\nf 1 1 1\n",
        "v 1e300 0 0\nf 1 1 1\n",
    ],
)
def test_a_damaged_obj_is_an_error_of_ours(tmp_path, text):
    path = tmp_path / "bad.obj"
    path.write_text(text)
    with pytest.raises(DnnvssError) as told:
        read_obj(path)
    assert told.value.file == path


def test_an_obj_of_more_vertices_than_may_be_is_refused_as_it_is_read(tmp_path, monkeypatch):
    monkeypatch.setattr("dnnvss.face.mesh.obj.MOST_VERTICES", 1000)
    path = tmp_path / "huge.obj"
    path.write_text("v 0 0 0\n" * 1001 + "v is not read\n")
    with pytest.raises(DnnvssError, match="more than 1,000 vertices"):
        read_obj(path)


def test_a_glb_comes_back_with_its_shapes(glb):
    read = read_gltf(glb)
    assert read.names == HEAD.names
    used = np.unique(HEAD.mesh.triangles)
    assert len(read.mesh.vertices) <= len(used)
    weights = swing(8, "jawOpen", "mouthSmileLeft", "tongueOut")
    ours, theirs = HEAD.vertices(weights), read.vertices(weights)
    away, _ = cKDTree(np.hstack(ours[[0, 3, 7]])).query(np.hstack(theirs[[0, 3, 7]]))
    assert away.max() < 1e-6
    assert set(read.mesh.parts) == {p for p in HEAD.mesh.parts if len(HEAD.mesh.of_part(p))}


def test_a_glb_holds_one_animation_of_the_weights(glb):
    document, binary = parted(glb.read_bytes())
    (animation,) = document["animations"]
    sampler = animation["samplers"][0]
    assert animation["channels"][0]["target"] == {"node": 0, "path": "weights"}
    about = document["accessors"][sampler["output"]]
    view = document["bufferViews"][about["bufferView"]]
    values = np.frombuffer(binary, np.float32, about["count"], view["byteOffset"]).reshape(20, 52)
    np.testing.assert_allclose(values, swing(20, "jawOpen", "mouthPucker"), atol=1e-6)
    assert document["asset"]["extras"] == {"timecode": "00:00:00:00"}


def test_text_form_with_bytes_inside_and_beside(small, tmp_path):
    document, binary = parted(small.read_bytes())
    inside = as_gltf(
        tmp_path / "in.gltf",
        document,
        "data:application/octet-stream;base64," + base64.b64encode(binary).decode(),
    )
    (tmp_path / "head.bin").write_bytes(binary)
    beside = as_gltf(tmp_path / "out.gltf", document, "head.bin")
    np.testing.assert_array_equal(read_gltf(inside).mesh.vertices, read_gltf(beside).mesh.vertices)


def _far_view(d):
    d["bufferViews"][0]["byteOffset"] = 10**9


def _huge_count(d):
    d["accessors"][0]["count"] = 10**12


def _negative(d):
    d["bufferViews"][0]["byteOffset"] = -4


def _cycle(d):
    d["nodes"][0]["children"] = [0]


def _draco(d):
    d["extensionsRequired"] = ["KHR_draco_mesh_compression"]


def _no_mesh(d):
    d["meshes"] = []


def _wrong_type(d):
    d["accessors"][0]["type"] = "MAT4"


def _many_faces(d):
    d["meshes"][0]["primitives"] *= 150_000


def _text(d):
    d["accessors"] = "none"


def _outside(d):
    d["buffers"][0]["uri"] = "../../etc/passwd"


def _remote(d):
    d["buffers"][0]["uri"] = "http://example.org/head.bin"


@pytest.mark.parametrize(
    "harm",
    [
        _far_view,
        _huge_count,
        _negative,
        _cycle,
        _draco,
        _no_mesh,
        _wrong_type,
        _many_faces,
        _text,
        _outside,
        _remote,
    ],
)
def test_a_hostile_gltf_is_an_error_of_ours(small, tmp_path, harm):
    document, binary = parted(small.read_bytes())
    document["buffers"][0]["uri"] = "head.bin"
    (tmp_path / "head.bin").write_bytes(binary)
    harm(document)
    path = tmp_path / "bad.gltf"
    path.write_text(json.dumps(document))
    with pytest.raises(DnnvssError):
        read_gltf(path)


@pytest.mark.parametrize("cut", [3, 11, 19, 200, 1500])
def test_a_glb_cut_short_is_an_error_of_ours(small, tmp_path, cut):
    path = tmp_path / "cut.glb"
    path.write_bytes(small.read_bytes()[:cut])
    with pytest.raises(DnnvssError):
        read_gltf(path)


def test_khronos_finds_nothing_wrong(glb, tmp_path):
    node, npm = shutil.which("node"), shutil.which("npm")
    roots = (
        []
        if npm is None
        else [subprocess.run([npm, "root", "-g"], capture_output=True, text=True).stdout.strip()]
    )
    script = (
        "const v=require('gltf-validator');const fs=require('fs');v.validateBytes(new Uint8Array(fs.readFileSync("
        "process.argv[1]))).then(r=>console.log(JSON.stringify(r.issues)))"
    )
    places = os.pathsep.join([*roots, os.environ.get("DNNVSS_NODE_MODULES", "")])
    if node is None:
        pytest.skip("node is not installed, and Khronos' validator runs on it")
    made = subprocess.run(
        [node, "-e", script, str(glb)],
        capture_output=True,
        text=True,
        env={**os.environ, "NODE_PATH": places},
    )
    if "Cannot find module" in made.stderr:
        pytest.skip(
            "gltf-validator is not installed: npm i -g gltf-validator, or DNNVSS_NODE_MODULES=its folder"
        )
    issues = json.loads(made.stdout)
    assert issues["numErrors"] == issues["numWarnings"] == 0, issues
