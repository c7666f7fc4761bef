"""Values as bytes: numbers, texts, lists, tuples, dicts and numeric arrays. Nothing that is read can run."""

from __future__ import annotations

import json
from typing import IO, Any

import numpy as np

LARGEST = 256 << 20  # bytes of a message


def pack(value: Any) -> bytes:
    """One message: the length of the text, the text, and the arrays that it names."""
    arrays: list[np.ndarray] = []
    text = json.dumps(_plain(value, arrays)).encode()
    body = text + b"\n" + b"".join(np.ascontiguousarray(array).tobytes() for array in arrays)
    return len(body).to_bytes(8, "little") + body


def unpack(body: bytes) -> Any:
    """Undo `pack`, without the length."""
    text, _, data = body.partition(b"\n")
    try:
        return _value(json.loads(text), memoryview(data))
    except RecursionError:
        raise ValueError("lists in lists, too deep") from None


def read(stream: IO[bytes]) -> Any:
    """Read the next message; EOFError at the end."""
    return unpack(exactly(stream, message_length(exactly(stream, 8))))


def message_length(head: bytes) -> int:
    """Length of a message from its first 8 bytes."""
    length = int.from_bytes(head, "little")
    if length > LARGEST:
        raise ValueError(f"the answer has {length:,} bytes, more than {LARGEST:,}")
    return length


def exactly(stream: IO[bytes], count: int) -> bytes:
    """Read exactly `count` bytes."""
    data = stream.read(count)
    if len(data) < count:
        raise EOFError
    return data


def _plain(value: Any, arrays: list[np.ndarray]) -> Any:
    if isinstance(value, np.generic):
        value = value.item()
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, tuple):
        return {"tuple": [_plain(part, arrays) for part in value]}
    if isinstance(value, list | set | frozenset):
        return [_plain(part, arrays) for part in value]
    if isinstance(value, dict):
        return {"dict": [[_plain(key, arrays), _plain(part, arrays)] for key, part in value.items()]}
    if isinstance(value, np.ndarray) and value.dtype.kind in "biuf":
        at = sum(array.nbytes for array in arrays)
        arrays.append(value)
        return {"array": value.dtype.str, "shape": list(value.shape), "at": at}
    raise TypeError(f"a value of the type {type(value).__name__} cannot be returned")


def _value(plain: Any, data: memoryview) -> Any:
    if isinstance(plain, list):
        return [_value(part, data) for part in plain]
    if not isinstance(plain, dict):
        return plain
    if "tuple" in plain:
        return tuple(_value(part, data) for part in plain["tuple"])
    if "dict" in plain:
        return {_value(key, data): _value(part, data) for key, part in plain["dict"]}
    dtype, shape = np.dtype(plain["array"]), tuple(int(n) for n in plain["shape"])
    if dtype.kind not in "biuf":
        raise ValueError("the answer holds an array that is not of numbers")
    count = int(np.prod(shape, dtype=object))
    return np.frombuffer(data, dtype, count, plain["at"]).reshape(shape).copy()
