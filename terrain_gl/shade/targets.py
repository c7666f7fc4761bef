"""What a picture is drawn on: textures and framebuffers of its size."""

from typing import Any, TypeVar

import moderngl

from ..gpu.textures import depth_texture

Size = tuple[int, int]
Target = TypeVar("Target")


class Targets:
    """The depth of each sample, the kind and the colour of each pixel; they have no pixels until `resize`."""

    depth: moderngl.Texture  # of each sample: near plane over view depth, 0 for the sky
    kinds: moderngl.Texture  # glsl/shade/kind.glsl
    listed: moderngl.Buffer  # the pixels of one kind
    picture: moderngl.Texture  # the colours
    seen: moderngl.Framebuffer  # for the first pass
    kind: moderngl.Framebuffer
    screen: moderngl.Framebuffer  # for the second pass
    shaded: Any = None  # what `Picture` has shaded last

    def __init__(self, ctx: moderngl.Context, samples: int) -> None:
        self.size: Size = (0, 0)
        self._ctx = ctx
        self._samples = samples
        self._made: list[Any] = []
        self.drawn: moderngl.Texture | None = None  # facts about the mesh: `detail`

    def resize(self, size: Size) -> None:
        """Change the size; all pixels are lost."""
        self.release()
        ctx, samples = self._ctx, self._samples if self._samples > 1 else 0
        self.depth = self._keep(depth_texture(ctx, size, samples))
        self.kinds = self._keep(depth_texture(ctx, size, 0))
        self.listed = self._keep(ctx.buffer(reserve=16 + 4 * size[0] * size[1]))
        self.picture = self._keep(ctx.texture(size, 4))
        self.seen = self._keep(ctx.framebuffer([], self.depth))
        self.kind = self._keep(ctx.framebuffer([], self.kinds))
        self.screen = self._keep(ctx.framebuffer([self.picture], self.kinds))
        self.size = size

    @property
    def detail(self) -> moderngl.Framebuffer:
        """The framebuffer for styles that show the mesh. It holds more data, and takes more memory and time."""
        if self.drawn is None:
            self.drawn = self._keep(self._ctx.texture(self.size, 4, samples=self.depth.samples, dtype="f2"))
            self._detail = self._keep(self._ctx.framebuffer([self.drawn], self.depth))
        return self._detail

    def release(self) -> None:
        """Release GPU resources; the size is (0, 0) until `resize`, also if memory does not suffice there."""
        self.size, self.drawn = (0, 0), None
        while self._made:
            self._made.pop().release()

    def _keep(self, made: Target) -> Target:
        self._made.append(made)
        return made
