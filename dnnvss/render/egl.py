"""Shapes laid over one another by EGL: on a graphics card without a screen, or by Mesa on the processor."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cache
from threading import Lock
from typing import TYPE_CHECKING

import numpy as np

from dnnvss.errors import DnnvssError

if TYPE_CHECKING:
    import moderngl

_LIBRARIES = {"libgl": "libGL.so.1", "libegl": "libEGL.so.1"}
_ON_PROCESSOR = ("llvmpipe", "softpipe", "swrast", "swiftshader", "software")
"""What the renderers call themselves that have no graphics card."""

_CORNER = """
#version 330
uniform vec2 size;
in vec2 place;
in vec3 colour;
flat out vec3 shade;
void main() { shade = colour; gl_Position = vec4(2.0 * place / size - 1.0, 0.0, 1.0); }
"""
_SHADE = """
#version 330
flat in vec3 shade;
out vec3 seen;
void main() { seen = shade; }
"""
_WHOLE = """
#version 330
void main() { gl_Position = vec4(4.0 * (gl_VertexID & 1) - 1.0, 4.0 * (gl_VertexID >> 1) - 1.0, 0.0, 1.0); }
"""
_MEAN = """
#version 330
uniform sampler2D drawn;
uniform int smooth_;
out vec3 seen;
void main() {
    ivec2 first = smooth_ * ivec2(gl_FragCoord.xy);
    vec3 sum = vec3(0.0);
    for (int y = 0; y < smooth_; y++) for (int x = 0; x < smooth_; x++)
        sum += texelFetch(drawn, first + ivec2(x, y), 0).rgb;
    seen = sum / float(smooth_ * smooth_);
}
"""


@dataclass(frozen=True)
class Egl:
    """What this process draws with.

    Args:
        context: of OpenGL.
        renderer: what it calls itself.
        lock: held by the thread in which the context is current.
    """

    context: "moderngl.Context"
    renderer: str
    lock: Lock = field(default_factory=Lock)

    @property
    def by_card(self) -> bool:
        """Whether a graphics card draws, and not the processor."""
        return not any(name in self.renderer.lower() for name in _ON_PROCESSOR)

    @contextmanager
    def current(self) -> Iterator["moderngl.Context"]:
        """The context, current in this thread and in no other."""
        with self.lock, self.context:
            self.context.gc()  # frees what was dropped in any thread
            yield self.context


@cache
def open_egl() -> Egl:
    """OpenGL without a screen, once a process.

    Raises:
        DnnvssError: moderngl or the system's EGL is not installed, or its driver gives no OpenGL 3.3.
    """
    try:
        import moderngl
    except ImportError as error:
        raise DnnvssError("EGL is asked for, and moderngl is not installed",
                          remedy='Install it: pip install "dnnvss[egl]"; or DNNVSS_DRAW=opencv') from error
    try:
        context = moderngl.create_context(standalone=True, backend="egl", require=330, **_LIBRARIES)
    except Exception as error:  # glcontext has no errors of its own
        raise DnnvssError(f"EGL does not draw here: {error}",
                          remedy="Install libegl1 and a driver (libgl1-mesa-dri without a graphics card), with the "
                                 "system's package manager; or DNNVSS_DRAW=opencv") from error
    context.gc_mode = "context_gc"  # nothing is freed before the context is current
    return Egl(context, context.info["GL_RENDERER"])


class EglFill:
    """Lays shapes over one another by EGL; arguments as :func:`dnnvss.render.fill.fill_for`.

    Raises:
        DnnvssError: as :func:`open_egl`, or the picture is too large for the driver.
    """

    def __init__(self, size: tuple[int, int], ground: tuple[int, int, int], smooth: int) -> None:
        self.size, self.ground = size, ground
        self._egl = open_egl()
        drawn = size[0] * smooth, size[1] * smooth
        with self._egl.current() as gl:
            if max(drawn) > (most := gl.info["GL_MAX_TEXTURE_SIZE"]):
                raise DnnvssError(f"a picture of {drawn[0]} x {drawn[1]} is too large for EGL here, which draws {most}",
                                  remedy="Ask for a smaller one, or DNNVSS_DRAW=opencv")
            self._fine = gl.texture(drawn, 4)
            self._large = gl.framebuffer(self._fine)
            self._small = gl.simple_framebuffer(size, 4)
            self._draw = gl.program(_CORNER, _SHADE)
            self._draw["size"] = size
            self._shrink = gl.program(_WHOLE, _MEAN)
            self._shrink["smooth_"] = smooth
            self._all = gl.vertex_array(self._shrink, [])
        self._room = 0

    def __call__(self, corners: np.ndarray, colours: np.ndarray) -> np.ndarray:
        """The picture (see :class:`~dnnvss.render.fill.Fill`)."""
        rows = np.zeros((len(corners), 4), _CORNERS)
        rows["place"] = corners
        rows["colour"][..., :3] = np.round(colours)[:, None]
        with self._egl.current() as gl:
            self._make_room(gl, len(corners))
            self._large.use()
            gl.clear(*(v / 255 for v in self.ground))
            self._corners.write(rows)
            self._shapes.render(vertices=6 * len(corners))
            self._small.use()
            self._fine.use(0)
            self._all.render(vertices=3)
            seen = self._small.read(components=3, alignment=1)
        return np.frombuffer(seen, np.uint8).reshape(self.size[1], self.size[0], 3)

    def _make_room(self, gl: "moderngl.Context", count: int) -> None:
        """Buffers for so many shapes: each is two triangles."""
        if count <= self._room:
            return
        self._room = count
        turns = (4 * np.arange(count)[:, None] + [0, 1, 2, 0, 2, 3]).astype(np.uint32)
        self._corners = gl.buffer(reserve=count * 4 * _CORNERS.itemsize, dynamic=True)
        self._shapes = gl.vertex_array(self._draw, [(self._corners, "2f 3f1 x1", "place", "colour")], gl.buffer(turns))


_CORNERS = np.dtype([("place", np.float32, 2), ("colour", np.uint8, 4)])
