"""Buffers that values own. A pool uses a buffer again when nobody holds the value that owned it."""

from __future__ import annotations

import moderngl


class OwnedBuffer:
    """A buffer with one owner. It goes back to its pool with the last reference to this object."""

    def __init__(self, buffer: moderngl.Buffer, free: list[moderngl.Buffer]) -> None:
        self.buffer = buffer
        self._free = free

    def __del__(self) -> None:  # another context may be current here, so nothing is released
        self._free.append(self.buffer)


class BufferPool:
    """Buffers for one kind of data.

    Parameters
    ----------
    size
        Bytes of each buffer. When more are needed, new buffers are larger, and smaller ones go.
    """

    def __init__(self, ctx: moderngl.Context, size: int) -> None:
        self._ctx = ctx
        self._size = size
        self._made: list[moderngl.Buffer] = []
        self._free: list[moderngl.Buffer] = []

    @property
    def made_bytes(self) -> int:
        """GPU memory of all buffers, those in use included."""
        return sum(buffer.size for buffer in self._made)

    def own(self, needed: int = 0) -> OwnedBuffer:
        """A buffer of at least `needed` bytes; its content is undefined."""
        if needed > self._size:
            self._size = needed + needed // 2
        while self._free:
            buffer = self._free.pop()
            if buffer.size == self._size:
                return OwnedBuffer(buffer, self._free)
            self._made.remove(buffer)
            buffer.release()
        buffer = self._ctx.buffer(reserve=self._size)
        self._made.append(buffer)
        return OwnedBuffer(buffer, self._free)

    def filled(self, data: bytes) -> OwnedBuffer:
        """A buffer that begins with `data`."""
        owned = self.own(len(data))
        owned.buffer.write(data)
        return owned

    def release(self) -> None:
        """Release GPU resources, those in use included."""
        while self._made:
            self._made.pop().release()
