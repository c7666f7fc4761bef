"""Maps inside .zip and .gz files: unpacked to a temporary folder, which is removed after reading."""

import codecs
import gzip
import os
import shutil
import tempfile
import zipfile
import zlib
from collections.abc import Callable
from dataclasses import replace
from typing import IO

from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.readers.raster import Raster, one_line, read_within
from terrain_gl.readers.refusals import step_for_archive

MOST_BYTES = 1 << 32  # most bytes of the unpacked files
MAPS = (
    *(".tif", ".tiff", ".png", ".exr", ".hdr", ".npy", ".hgt", ".asc", ".img", ".nc", ".grd", ".bil", ".flt"),
    *(".dem", ".dt0", ".dt1", ".dt2", ".pgm", ".r16", ".raw", ".xyz", ".vrt"),
    *(".webp", ".gif", ".jxl", ".sgi", ".tga", ".bmp", ".jp2", ".jpg"),
)
TEXTS = (".asc", ".txt", ".xyz", ".csv", ".grd")
Opener = Callable[[str], Raster]


def open_gzip(path: str, name: str, opener: Opener) -> Raster:
    """Open the file in a .gz. The unpacked file has the archive's name without .gz."""
    inner = os.path.basename(path)
    inner = inner[:-3] if inner.lower().endswith(".gz") else inner

    def unpack(folder: str) -> str:
        with gzip.open(path) as packed:
            _copy(packed, os.path.join(folder, inner), name)
        return inner

    return _unpacked(name, unpack, opener)


def open_zip(path: str, name: str, opener: Opener) -> Raster:
    """Open the only map in a .zip, together with the files of the same folder."""

    def unpack(folder: str) -> str:
        with zipfile.ZipFile(path) as archive:
            members = [member for member in archive.namelist() if not member.startswith("__MACOSX")]
            maps = [member for member in members if member.lower().endswith(MAPS)]
            if len(maps) != 1:
                raise TerrainError(step_for_archive(name, members, maps))
            inner = maps[0]
            within = os.path.dirname(inner)
            for member in archive.infolist():
                if os.path.dirname(member.filename) == within and not member.is_dir():
                    with archive.open(member) as packed:
                        _copy(packed, os.path.join(folder, os.path.basename(member.filename)), name)
        return os.path.basename(inner)

    return _unpacked(name, unpack, opener)


def encoding_of(path: str, head: bytes) -> str | None:
    """The encoding of a text that begins with a byte order mark, or of UTF-16 without one; None for other files."""
    if not path.lower().endswith(TEXTS):  # the first numbers of a binary file may look like a mark
        return None
    for mark, encoding in (
        (codecs.BOM_UTF8, "utf-8-sig"),
        (codecs.BOM_UTF32_LE, "utf-32"),  # before UTF-16, whose mark it begins with
        (codecs.BOM_UTF16_LE, "utf-16"),
        (codecs.BOM_UTF16_BE, "utf-16"),
    ):
        if head.startswith(mark):
            return encoding
    letters = head[:16]
    for encoding, zeros, others in (
        ("utf-16-le", letters[1::2], letters[::2]),
        ("utf-16-be", letters[::2], letters[1::2]),
    ):
        if len(letters) == 16 and not any(zeros) and all(9 <= letter < 127 for letter in others):
            return encoding
    return None


def open_text(path: str, name: str, encoding: str, opener: Opener) -> Raster:
    """Open a grid of text in this encoding, together with its .prj, as ASCII, which GDAL reads."""

    def unpack(folder: str) -> str:
        inner = os.path.basename(path)
        with open(path, encoding=encoding) as text, open(os.path.join(folder, inner), "w", encoding="ascii") as file:
            file.write(text.read(1 << 10).lstrip())
            while piece := text.read(1 << 20):
                file.write(piece)
        for beside in (os.path.splitext(path)[0] + ".prj", path + ".aux.xml"):
            if os.path.isfile(beside) and not os.path.islink(beside):
                shutil.copy(beside, folder)
        return inner

    return _unpacked(name, unpack, opener)


def _unpacked(name: str, unpack: Callable[[str], str], opener: Opener) -> Raster:
    folder = tempfile.TemporaryDirectory(prefix="terrain-gl-")
    try:
        raster = opener(os.path.join(folder.name, unpack(folder.name)))
    except TerrainError as error:
        folder.cleanup()
        within = str(error).replace(folder.name, name)
        raise TerrainError(within.replace(os.path.join(name, os.path.basename(name)), name)) from None  # a text
    except (
        OSError,
        EOFError,
        RuntimeError,
        UnicodeError,
        zlib.error,
        zipfile.BadZipFile,
        NotImplementedError,
    ) as error:
        folder.cleanup()
        raise TerrainError(f"{name}: does not unpack ({one_line(error)}): unpack it first") from None
    return replace(raster, name=name, blocks=read_within(folder, raster.blocks), has_windows=False)


def _copy(packed: gzip.GzipFile | IO[bytes], path: str, name: str) -> None:
    """Unpack a file, up to a limit, because a few kilobytes may expand to fill the disk."""
    left = min(MOST_BYTES, shutil.disk_usage(os.path.dirname(path)).free // 2)
    with open(path, "wb") as file:
        while piece := packed.read(1 << 20):
            left -= len(piece)
            if left < 0:
                raise TerrainError(f"{name}: unpacks to more than 4 GiB or half the free disk: unpack it yourself")
            file.write(piece)
